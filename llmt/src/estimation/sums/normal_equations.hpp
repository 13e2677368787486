/// \file
/// The sums over rows from which the local models of a partition are estimated.
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

namespace llmt {

/// The sums (E.4) of docs/algorithms/estimation.md. With a = [1, x], Phi_i the validity of leaf i, q the weights and r
/// the residuals of the root's model, sums over rows of
///   S_ij = q Phi_i Phi_j a a',  G_i = q Phi_i a a',  b_i = q Phi_i a r,  q Phi_i r^2
/// in columns divided by TrainingRows::scale. Where values are missing, a depends on the leaf.
struct NormalEquations {
  Eigen::Index size = 0;    ///< coefficients of a local model
  bool missing = false;     ///< some value is missing; then blocks are not symmetric and are stored in full
  std::vector<int> leaves;  ///< nodes, from left to right in the tree
  /// S_ij of leaf i with those of the leaves j = 0 ... i that share a row with it, lower triangles row by row.
  std::vector<std::map<int, std::vector<double>>> blocks;
  std::vector<Eigen::MatrixXd> gram;      ///< G of every node, size x size
  std::vector<Eigen::MatrixXd> products;  ///< b of every node, size x outputs
  std::vector<Eigen::VectorXd> squares;   ///< of the residuals, of every node, one per output

  /// S_ij, which is among `blocks`.
  Eigen::MatrixXd block(std::size_t i, int j) const;
};

}  // namespace llmt
