#include <cmath>
#include <limits>
#include <stdexcept>

#include "llmt/discovery/least_squares.hpp"

namespace llmt::discovery {

Eigen::MatrixXd difference_jacobian(const LeastSquaresProblem& problem, const Eigen::VectorXd& values) {
  const double relative_step = std::cbrt(std::numeric_limits<double>::epsilon());
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd moved = values;
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    const double step = relative_step * std::max(std::abs(values(k)), problem.parameters[k].scale);
    moved(k) = values(k) + step;
    const double upper = moved(k);
    const Eigen::VectorXd above = problem.residual(moved);
    moved(k) = values(k) - step;
    const double lower = moved(k);
    const Eigen::VectorXd below = problem.residual(moved);
    moved(k) = values(k);
    if (k == 0) jacobian.resize(above.size(), values.size());
    jacobian.col(k) = (above - below) / (upper - lower);  // the step that was really taken, after rounding
  }
  return jacobian;
}

Eigen::MatrixXd evaluate_jacobian(const LeastSquaresProblem& problem, const Eigen::VectorXd& values) {
  return problem.jacobian ? problem.jacobian(values) : difference_jacobian(problem, values);
}

JacobianCheck check_jacobian(const LeastSquaresProblem& problem) {
  if (!problem.jacobian) {
    throw std::invalid_argument("llmt::discovery::check_jacobian: the problem has no analytic Jacobian");
  }
  Eigen::VectorXd values(std::ssize(problem.parameters));
  for (Eigen::Index k = 0; k < values.size(); ++k) values(k) = problem.parameters[k].value;
  const Eigen::MatrixXd analytic = problem.jacobian(values);
  const Eigen::MatrixXd difference = difference_jacobian(problem, values);
  if (analytic.rows() != difference.rows() || analytic.cols() != difference.cols()) {
    throw std::invalid_argument("llmt::discovery::check_jacobian: the Jacobian is " + std::to_string(analytic.rows()) +
                                " x " + std::to_string(analytic.cols()) + ", expected " +
                                std::to_string(difference.rows()) + " x " + std::to_string(difference.cols()));
  }
  // A column that moves nothing is compared on the scale of the others, not on that of its own rounding.
  double largest = std::numeric_limits<double>::min();
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    largest = std::max(largest, difference.col(k).cwiseAbs().maxCoeff() * problem.parameters[k].scale);
  }
  JacobianCheck check;
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    const Parameter& parameter = problem.parameters[k];
    const double size = std::max(difference.col(k).cwiseAbs().maxCoeff(), 1e-6 * largest / parameter.scale);
    Eigen::Index row = 0;
    const double error = (analytic.col(k) - difference.col(k)).cwiseAbs().maxCoeff(&row) / size;
    if (error > check.error) check = {error, parameter.name, row};
  }
  return check;
}

}  // namespace llmt::discovery
