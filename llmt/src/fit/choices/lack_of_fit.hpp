/// \file
/// Whether the outputs' means at the values of an input lie on a straight line.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt {

/// The F test for lack of fit of a linear model (docs/algorithms/codes.md, Z.1).
class LackOfFit {
 public:
  /// Least squares of the outputs on `numbers` (rows x inputs; NaN: missing, taken as the mean).
  LackOfFit(const Eigen::Ref<const Eigen::MatrixXd>& numbers, const Eigen::Ref<const Eigen::MatrixXd>& outputs);

  /// The p-value of a constant of its own for each of the values of an input, `values`: the smallest of the outputs,
  /// times their number. 1 where these constants say nothing new.
  double p_value(const Eigen::Ref<const Eigen::VectorXd>& input, const std::vector<double>& values) const;

 private:
  Eigen::MatrixXd basis_;      // orthonormal columns
  Eigen::MatrixXd residuals_;  // of the outputs
};

}  // namespace llmt
