// The range of a Jacobian.
#pragma once

#include <Eigen/Core>

namespace llmt::robotics {

/// An orthonormal basis of the range. Columns shorter than 1e-7 of the longest one are taken for rounding.
Eigen::MatrixXd range_of(Eigen::MatrixXd jacobian);

}  // namespace llmt::robotics
