#include "numerics/aicc.hpp"

#include <Eigen/QR>
#include <cmath>
#include <limits>

namespace llmt {

double effective_parameters(const Eigen::MatrixXd& deviations, const Eigen::VectorXd& weights,
                            const Eigen::VectorXd& validity) {
  Eigen::MatrixXd a(deviations.rows(), deviations.cols() + 1);
  a << Eigen::VectorXd::Ones(deviations.rows()), deviations;
  const Eigen::VectorXd shared = weights.cwiseProduct(validity);
  const Eigen::MatrixXd first = a.transpose() * shared.asDiagonal() * a;
  const Eigen::MatrixXd second = a.transpose() * shared.cwiseProduct(validity).asDiagonal() * a;
  return first.completeOrthogonalDecomposition().solve(second).trace();
}

double aicc(double rows, double loss, double effective) {
  if (rows - effective - 1.0 <= 0.0) return std::numeric_limits<double>::infinity();
  return rows * std::log(loss / rows) + 2.0 * effective +
         2.0 * effective * (effective + 1.0) / (rows - effective - 1.0);
}

}  // namespace llmt
