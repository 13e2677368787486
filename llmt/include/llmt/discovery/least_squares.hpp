/// \file
/// Nonlinear least squares with named parameters, the engine of every calibration.
///
///     llmt::discovery::LeastSquaresProblem line;
///     line.parameters = {{.name = "slope", .unit = "1"}};
///     line.residual = [&](const Eigen::VectorXd& p) -> Eigen::VectorXd { return p(0) * t - y; };
///     line.jacobian = [&](const Eigen::VectorXd&) -> Eigen::MatrixXd { return t; };
///     const double slope = llmt::discovery::solve(line).parameter("slope").value;
#pragma once

#include <Eigen/Core>
#include <string>

#include "llmt/abi.hpp"
#include "llmt/discovery/problem.hpp"

namespace llmt::discovery {

/// Solves a problem by damped, rank-revealing Gauss-Newton steps.
///
/// Each step comes from the singular values of the scaled Jacobian (through its QR factorisation, so the cost is n
/// k^2). No step is taken along directions below the rank tolerance: combinations of parameters that the data do not
/// determine keep their start values and are reported by name. Outcomes, including failures, are fields of the result.
///
/// Throws std::invalid_argument for wrong options or parameters (empty or repeated name, non-finite value, scale <= 0,
/// prior <= 0), wrong shapes, and residuals or derivatives that are not finite at the start.
SolverResult solve(const LeastSquaresProblem& problem, const SolverOptions& options = {});

/// The Jacobian of the problem at `values`: analytic where given, else central differences; n x P.
Eigen::MatrixXd evaluate_jacobian(const LeastSquaresProblem& problem, const Eigen::VectorXd& values);

/// Central differences at `values`, n x P; the step of a column is cbrt(machine epsilon) * max(|value|, scale).
Eigen::MatrixXd difference_jacobian(const LeastSquaresProblem& problem, const Eigen::VectorXd& values);

/// Largest disagreement between the analytic Jacobian and central differences.
struct JacobianCheck {
  double error = 0.0;     ///< max over entries of |analytic - difference| / largest entry of the column
  std::string parameter;  ///< column of the maximum
  Eigen::Index row = 0;   ///< row of the maximum
};

/// Compares at the start values. Throws std::invalid_argument if the problem has no analytic Jacobian.
JacobianCheck check_jacobian(const LeastSquaresProblem& problem);

/// The name of an enumerator, e.g. "max_iterations".
std::string to_string(Termination termination);

}  // namespace llmt::discovery
