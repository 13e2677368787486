/// \file
/// The equations of the joint estimate (E.3) of docs/algorithms/estimation.md.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/matrix.hpp"
#include "estimation/constrained_estimate.hpp"
#include "estimation/sums/leaf_sums.hpp"

namespace llmt {

/// How strongly an estimate is drawn to a simpler one.
struct Regularisation {
  double ridge = 0.0;      ///< of the joint estimate, towards the local one
  double shrinkage = 0.0;  ///< of the local estimate, towards the parent's; in rows, see Candidate::shrinkage
  bool sparse = false;     ///< slopes that forward selection leaves out are 0
};

/// The normal equations of all leaves of a prefix at once, without regularisation.
struct JointEquations {
  Eigen::Index leaves = 0;
  std::vector<int> leaf_nodes;  ///< of the prefix, ascending
  std::vector<int> position;    ///< of every node of the tree at or below one of these: that leaf's position; else -1
  RowMajor matrix;              ///< upper triangle, one block of LeafSums::size() for each leaf
};
JointEquations joint_equations(const LeafSums& sums, Eigen::Index leaves);

/// The joint estimate of a prefix, before the constraints.
struct JointSolution {
  FreeEstimate estimate;               ///< factor: of the matrix of the unknowns
  Eigen::MatrixXd anchors;             ///< the local estimates of the leaves, one below the other
  std::vector<Eigen::Index> unknowns;  ///< sparse: positions of the unknowns among the leaves' coefficients
};
/// `local`: what local_models() gives for these nodes with this shrinkage and sparseness.
JointSolution solve(const LeafSums& sums, const JointEquations& equations, const Regularisation& regularisation,
                    const std::vector<Eigen::MatrixXd>& local);

/// The inverse of the regularised matrix times `right`; 0 where a sparse estimate has no unknown.
Eigen::MatrixXd times_inverse(const JointSolution& solution, const Eigen::MatrixXd& right);

/// The regularisation's part of the matrix, ridge x G_i + H_i for each leaf, times a change of the coefficients.
Eigen::MatrixXd times_regularisation(const LeafSums& sums, const JointEquations& equations,
                                     const Regularisation& regularisation, const Eigen::MatrixXd& change);

}  // namespace llmt
