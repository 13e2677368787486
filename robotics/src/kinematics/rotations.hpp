// Rotation vectors, and rotations and motions that fit points.
#pragma once

#include "llmt/robotics/kinematics.hpp"

namespace llmt::robotics {

/// The rotation vector w with exp([w]) = R, of length 0 to pi.
Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation);

/// [v]: [v] w = v x w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// The rotation R with the greatest trace of R matrix (Kabsch 1976; a reflection is turned back about the least axis).
Eigen::Matrix3d rotation_of_greatest_trace(const Eigen::Matrix3d& matrix);

/// The proper rotation and translation that carry `from` to `to` (n x 3) with the smallest squared distances (Kabsch
/// 1976).
Pose kabsch(const Eigen::MatrixXd& from, const Eigen::MatrixXd& to);

}  // namespace llmt::robotics
