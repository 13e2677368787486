/// \file
/// Blending a tree with given local models: the change of the models that the overlap of the leaves asks for.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/dataset.hpp"
#include "model/evaluator.hpp"

namespace llmt {

/// The correction (T.3) of docs/algorithms/stream.md: weighted least squares, on Phi_i [1, x] over all leaves i, of the
/// residuals of a blended partition,
///   sum_n q_n (y_n - f(x_n) - sum_i Phi_i(x_n) a_n' delta_i)^2 + ridge x sum_i delta_i' G_i delta_i,
/// G_i = sum_n q_n Phi_i a a'. It differs from the joint estimate of a batch (joint_estimate.hpp) in its anchor: the
/// models that are given, which may come from far more rows than the correction. Solved by a few steps of conjugate
/// gradients, preconditioned with the blocks of the leaves. A missing value counts as the mean of the leaf with the
/// largest validity.
class BlendCorrection {
 public:
  /// `blended`: one output, half widths set. The ranges of its nodes are widened to the rows that their validities
  /// reach.
  BlendCorrection(const TrainingRows& rows, Partition blended);

  Partition corrected(double ridge) const;

 private:
  void add_row(const Evaluator& evaluator, const Chunk& chunk, Eigen::Index row, std::vector<Activation>& active);
  Eigen::MatrixXd times_normal_matrix(const Eigen::MatrixXd& change) const;
  Eigen::MatrixXd gradient() const;

  Partition partition_;
  Eigen::Index size_;  // coefficients of a local model
  Eigen::VectorXd scale_;
  std::vector<int> leaves_;     // nodes
  std::vector<int> position_;   // of every node among the leaves
  std::vector<int> begins_;     // of each row's entries in the next two, and their end
  std::vector<int> positions_;  // among the leaves
  std::vector<double> validities_;
  Eigen::MatrixXd regressors_;  // size x rows: root of the weight times [1, scaled deviations]
  Eigen::VectorXd residuals_;   // times root of the weight
  std::vector<Eigen::MatrixXd> grams_;
};

}  // namespace llmt
