// A simulation that is known only as a table, described as a function of its inputs.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt::discovery {

/// A function that describes less of the variance of an output has other derivatives than the simulation.
inline constexpr double well_described = 0.98;
/// One that describes less of it knows neither jumps of the simulation nor what errors of the inputs do to it.
inline constexpr double roughly_described = 0.9;

/// Least squares of simulated outputs on a constant, x, x^2, x^3, x x', x^2 x' (up to 8 inputs), sin x and cos x of
/// inputs that stay within half a turn or more of zero, and sgn x, |x|, x |x| of inputs that change sign. Where these
/// describe less than 98 % of the variance, peaks sgn x exp(-(2^k x / s)^2) are tried, k = 0 to 6, s the spread of x:
/// Stribeck's law, or dry friction that a simulation has made smooth. They stay for inputs where they take a fifth off
/// what is not described. Errors of the inputs do no harm: the table was computed from the same inputs, so it is an
/// exact function of them.
class Surrogate {
 public:
  /// `inputs` n x p, `simulated` n x d.
  Surrogate(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& simulated);

  /// n x d.
  Eigen::MatrixXd predict(const Eigen::MatrixXd& inputs) const;
  /// Derivative by input number `column`, by central differences; n x d.
  Eigen::MatrixXd derivative(const Eigen::MatrixXd& inputs, Eigen::Index column) const;
  /// The part that jumps: sgn x and peaks of those inputs of which they are more than what is not described; n x d.
  Eigen::MatrixXd jumps(const Eigen::MatrixXd& inputs) const;
  /// d: share of the variance of each output that is described on rows left out of the fit (five parts in turn).
  const Eigen::VectorXd& described() const { return described_; }

 private:
  Eigen::RowVectorXd centre_;
  Eigen::RowVectorXd spread_;
  Eigen::RowVectorXd low_;
  Eigen::RowVectorXd high_;
  bool with_products_ = true;
  std::vector<bool> with_peaks_;  // of inputs
  Eigen::MatrixXd coefficients_;
  Eigen::VectorXd described_;
  Eigen::VectorXd undescribed_;  // mean squares

  bool changes_sign(Eigen::Index input) const { return low_(input) < 0.0 && high_(input) > 0.0; }
  void fit(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& simulated);
  // The columns of an input that jump.
  struct Dry {
    Eigen::Index first = 0;
    Eigen::Index count = 0;
  };
  Eigen::MatrixXd features(const Eigen::MatrixXd& inputs, std::vector<Dry>* dry = nullptr) const;
};

}  // namespace llmt::discovery
