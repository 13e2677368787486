// The frames of a robot in closed form.
#pragma once

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// The proper rotation and translation that carry `from` to `to` (n x 3) with the smallest squared distances (Kabsch
/// 1976).
Pose kabsch(const Eigen::MatrixXd& from, const Eigen::MatrixXd& to);

/// Fixed-axis roll, pitch, yaw in degrees of R = Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Vector3d roll_pitch_yaw_deg(const Eigen::Matrix3d& rotation);

/// The robot with the base that Kabsch finds for its present tool. Needs x, y and z measured.
Robot with_closed_form_base(Robot robot, const Measurements& measurements);

}  // namespace llmt::robotics
