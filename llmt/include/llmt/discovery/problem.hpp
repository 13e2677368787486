/// \file
/// A least-squares problem with named parameters, and the outcome of its solution.
///
///     const llmt::discovery::Parameter length{.name = "joint2.a", .unit = "mm", .value = 425.0, .prior_sigma = 5.0};
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt::discovery {

/// One unknown d_k of the constraint equations f(d, s, w) = 0.
struct Parameter {
  std::string name;    ///< unique, e.g. "joint2.a"
  std::string unit;    ///< of `value`, for messages and reports only
  double value = 0.0;  ///< where the iteration starts; in a result, where it ended
  double scale = 1.0;  ///< > 0: a change that is typical for this parameter; makes columns comparable
  bool free = true;    ///< false: kept at `value`
  std::optional<double> prior_sigma = {};  ///< > 0: `prior_value` is an observation with this standard deviation
  std::optional<double> prior_value = {};  ///< empty: the start value
};

/// All constraint equations stacked, eq. (4) of Benes et al. 2022: values of all parameters (fixed ones included) -> n
/// residuals. The number of residuals must not depend on the values.
using Residual = std::function<Eigen::VectorXd(const Eigen::VectorXd& values)>;

/// Derivatives of the residuals, n x (number of parameters), columns of fixed parameters included (they are not read).
using Jacobian = std::function<Eigen::MatrixXd(const Eigen::VectorXd& values)>;

/// minimise  sum_i (weight_i residual_i(d))^2 + sum_k ((d_k - prior_k) / prior_sigma_k)^2  over the free parameters.
struct LeastSquaresProblem {
  std::vector<Parameter> parameters;
  Residual residual;
  Jacobian jacobian;        ///< empty: central differences
  Eigen::VectorXd weights;  ///< n factors of the residuals, usually 1/sigma; empty: all 1
};

struct SolverOptions {
  /// Levenberg-Marquardt damping to start with, relative to the largest singular value squared. 0 is the paper's
  /// modified Newton method, eq. (6)-(9): full Gauss-Newton steps as long as the deviations decrease.
  double damping = 1e-4;
  int max_iterations = 100;          ///< steps tried and taken
  double gradient_tolerance = 1e-7;  ///< on the cosine of the angle between the residuals and the range of the Jacobian
  double step_tolerance = 1e-9;      ///< on the undamped step, counted in parameter scales
  double rank_tolerance = 1e-8;      ///< singular values below this share of the largest count as zero
  /// True: the weights are 1/sigma of known noise, and the covariance is not rescaled by the residual variance.
  bool sigma_is_known = false;
};

/// Why the iteration ended. Only `converged` means that the values are a minimum.
enum class Termination {
  converged,       ///< gradient or undamped step below tolerance: no further decrease is possible
  max_iterations,  ///< the allowed steps are used up
  diverged,        ///< an undamped step made the deviations grow
  stalled,     ///< no damping gives a decrease although the gradient is not small: suspect the Jacobian or the scales
  non_finite,  ///< residuals or derivatives became NaN or infinite; the values are the last finite ones
  no_free_parameters,  ///< nothing to do
  no_information       ///< no free parameter changes any residual
};

/// A direction in parameter space that changes no residual: sum of coefficient * (unit step of the named parameter).
struct Combination {
  struct Term {
    std::string name;
    double coefficient;  ///< in units of the parameter; the largest term, counted in scales, has its scale
  };
  std::vector<Term> terms;

  std::string names() const;  ///< "base.z, joint1.d"
};

/// Outcome of solve(). P = number of parameters, n = number of residuals, k = number of free parameters.
struct SolverResult {
  std::vector<Parameter> parameters;  ///< with final values
  Eigen::VectorXd values;             ///< P final values
  Eigen::VectorXd residuals;          ///< n final residuals, not weighted
  /// P x P; zero for fixed parameters, NaN for parameters in an unidentifiable combination.
  Eigen::MatrixXd covariance;
  Eigen::VectorXd standard_errors;  ///< P; square roots of the diagonal of `covariance`
  /// k, falling: of the Jacobian with weighted rows and columns times `scale`, priors included.
  Eigen::VectorXd singular_values;
  double condition_number = 1.0;  ///< of that matrix, on its identifiable part
  /// cond2(J'J) = (s1/sL)^2 on the identifiable part; J in the parameters' own units, without weights.
  double calibrability = 1.0;
  Eigen::Index rank = 0;  ///< number of identifiable directions
  /// n - trace of the hat matrix of the data, rounded: n - rank without priors, and a prior that holds its parameter
  /// instead of the data gives one back.
  Eigen::Index dof = 0;
  /// sqrt(weighted sum of squares of the residuals / dof before rounding); priors are not in it.
  double sigma = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> residual_norms;  ///< weighted, with priors: at the start and after every accepted step
  int iterations = 0;                  ///< steps tried
  Termination termination = Termination::max_iterations;
  std::string reason;                       ///< the termination in words and figures
  std::vector<Combination> unidentifiable;  ///< null directions, sparse; their parameters stay where they started

  bool converged() const { return termination == Termination::converged; }
  /// Throws std::invalid_argument if there is no parameter of that name.
  const Parameter& parameter(const std::string& name) const;
  double standard_error(const std::string& name) const;
};

}  // namespace llmt::discovery
