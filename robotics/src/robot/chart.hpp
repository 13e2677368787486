// What an instrument reads of a tool pose.
#pragma once

#include <Eigen/Core>

#include "llmt/robotics/kinematics.hpp"
#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

/// The reading of a tool pose, see Reading. `observation` may be null: the position.
Eigen::Vector3d reading_of(const Pose& tool, const Observation* observation);

/// Its derivative by a small motion of the tool: by its displacement in mm, or, of an orientation, by its rotation
/// vector in rad; both in the world frame.
Eigen::Matrix3d reading_derivative(const Pose& tool, const Observation& observation);

}  // namespace llmt::robotics
