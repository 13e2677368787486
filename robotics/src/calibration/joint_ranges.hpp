// The joint values that a calibration saw.
#pragma once

#include <array>
#include <vector>

#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

/// Smallest and largest value of each joint over the poses, deg or mm as limits are.
std::vector<std::array<double, 2>> joint_ranges_of(const Chain& chain, const Poses& poses);

}  // namespace llmt::robotics
