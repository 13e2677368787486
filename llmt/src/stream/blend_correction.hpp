/// \file
/// Blending a tree whose local models are known: what the models must change by.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "data/dataset.hpp"
#include "model/evaluator.hpp"

namespace llmt {

/// Weighted least squares of what a blended partition leaves of the outputs on Phi_i [1, x] over all leaves i:
///   sum_n q_n (y_n - f(x_n) - sum_i Phi_i(x_n) a_n' delta_i)^2 + ridge * sum_i delta_i' G_i delta_i,
/// G_i = sum_n q_n Phi_i a a'. As the joint estimate of JointFit, but anchored at given models instead of at local
/// estimates on the same rows: the models may come from far more rows than the correction does. By a few steps of
/// conjugate gradients, preconditioned with the blocks of the leaves. A missing value counts as the mean of the leaf of
/// largest validity.
class BlendCorrection {
 public:
  /// `blended`: one output, half widths set. Ranges of its nodes are widened to the rows that their validities reach.
  BlendCorrection(const TrainingRows& rows, Partition blended);

  Partition corrected(double ridge) const;
  const Partition& uncorrected() const { return partition_; }

 private:
  Eigen::VectorXd apply(const Eigen::VectorXd& change) const;

  Partition partition_;
  Eigen::Index size_;
  Eigen::VectorXd scale_;
  std::vector<int> leaves_;     // nodes
  std::vector<int> begins_;     // of each row's entries below, and their end
  std::vector<int> positions_;  // among the leaves
  std::vector<double> validities_;
  Eigen::MatrixXd regressors_;  // size x rows: root of the weight times [1, scaled deviations]
  Eigen::VectorXd residuals_;   // times root of the weight
  std::vector<Eigen::MatrixXd> grams_;
};

}  // namespace llmt
