// Joints that hardly moved while the arm was measured.
#pragma once

#include <vector>

#include "llmt/robotics/calibration_options.hpp"
#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

/// Joints whose values stay within still_range(), in the order of the chain.
std::vector<StillJoint> still_joints(const Chain& chain, const Poses& poses);

/// The poses with every still joint in the middle of its range. What only the motion of a still joint tells shows
/// nothing in derivatives at these poses.
Poses with_still_joints_held(const Chain& chain, Poses poses);

}  // namespace llmt::robotics
