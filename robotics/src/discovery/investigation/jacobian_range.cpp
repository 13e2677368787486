#include "discovery/investigation/jacobian_range.hpp"

#include "linear_algebra/linear_algebra.hpp"

namespace llmt::robotics {

Eigen::MatrixXd range_of(Eigen::MatrixXd jacobian) {
  constexpr double nothing = 1e-7;
  const double least = jacobian.cols() > 0 ? nothing * column_norms(jacobian).maxCoeff() : 0.0;
  for (auto column : jacobian.colwise()) {
    column *= column.norm() > least ? 1.0 / column.norm() : 0.0;
  }
  return orthonormal_range(jacobian);
}

}  // namespace llmt::robotics
