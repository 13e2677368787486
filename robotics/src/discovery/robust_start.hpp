// A first calibration that a few wrong measurements cannot steer.
#pragma once

#include <vector>

#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {

/// The middle one of n values; of an even number the upper of the two.
double median_of(const Eigen::VectorXd& values);

struct RobustStart {
  Calibration calibration;
  std::vector<std::size_t> left_out;  ///< samples that it was made without, ascending
};

/// Calibrates; where some samples lie far from the rest, again without them, until the same ones are left out (least
/// squares with weights 0 and 1). What is left out is not judged yet: an effect that acts at few poses looks the same.
RobustStart robust_start(const Robot& robot, const Measurements& measurements, const CalibrationOptions& options);

}  // namespace llmt::robotics
