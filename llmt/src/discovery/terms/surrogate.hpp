// A simulation that is known only as a table, described as a function of its inputs.
#pragma once

#include <Eigen/Core>

namespace llmt::discovery {

/// Least squares of simulated outputs on a constant, x, x^2, x^3, x x', x^2 x' (up to 8 inputs), sin x and cos x of
/// inputs that stay within half a turn or more of zero, and sgn x, |x|, x |x| of inputs that change sign. Errors of the
/// inputs do no harm: the table was computed from the same inputs, so it is an exact function of them.
class Surrogate {
 public:
  /// `inputs` n x p, `simulated` n x d.
  Surrogate(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& simulated);

  /// n x d.
  Eigen::MatrixXd predict(const Eigen::MatrixXd& inputs) const;
  /// Derivative by input number `column`, by central differences; n x d.
  Eigen::MatrixXd derivative(const Eigen::MatrixXd& inputs, Eigen::Index column) const;
  /// The part that jumps: coefficients times sgn x of the inputs that change sign; n x d.
  Eigen::MatrixXd jumps(const Eigen::MatrixXd& inputs) const;
  /// d: share of the variance of each output that is described on rows left out of the fit (five parts in turn).
  const Eigen::VectorXd& described() const { return described_; }

 private:
  Eigen::RowVectorXd centre_;
  Eigen::RowVectorXd spread_;
  Eigen::RowVectorXd low_;
  Eigen::RowVectorXd high_;
  bool with_products_ = true;
  Eigen::MatrixXd coefficients_;
  Eigen::VectorXd described_;

  bool changes_sign(Eigen::Index input) const { return low_(input) < 0.0 && high_(input) > 0.0; }
  Eigen::MatrixXd features(const Eigen::MatrixXd& inputs) const;
};

}  // namespace llmt::discovery
