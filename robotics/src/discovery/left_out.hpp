// Errors of poses that a fit did not see, without fitting anew.
#pragma once

#include <Eigen/Core>

#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {

/// Distances when each sample is left out of a linear fit: (I - H_ii)^-1 e_i; `used` (k x N) such that H = used' used,
/// d components a sample.
Eigen::VectorXd left_out(const Eigen::MatrixXd& used, const Eigen::VectorXd& errors, Eigen::Index d);

/// The distance of every pose from a robot that was fitted without it: by the Jacobian of the calibration's free
/// parameters for the poses that were fitted, as they are for the others (`skipped`, ascending).
Eigen::VectorXd left_out(const Calibration& fitted, const Measurements& measurements,
                         const std::vector<std::size_t>& skipped);

}  // namespace llmt::robotics
