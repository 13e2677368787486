#include "discovery/investigation/jacobian_range.hpp"

#include <Eigen/QR>

namespace llmt::robotics {

Eigen::MatrixXd range_of(Eigen::MatrixXd jacobian) {
  constexpr double nothing = 1e-7;
  const double least = jacobian.cols() > 0 ? nothing * jacobian.colwise().norm().maxCoeff() : 0.0;
  for (auto column : jacobian.colwise()) {
    column *= column.norm() > least ? 1.0 / column.norm() : 0.0;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(jacobian);
  factors.setThreshold(1e-9);
  Eigen::MatrixXd basis = Eigen::MatrixXd::Identity(jacobian.rows(), factors.rank());
  basis.applyOnTheLeft(factors.householderQ());
  return basis;
}

}  // namespace llmt::robotics
