#pragma once

#include <Eigen/Core>

namespace llmt::robotics {

/// The middle one of n values; of an even number the upper of the two.
double median_of(const Eigen::VectorXd& values);

}  // namespace llmt::robotics
