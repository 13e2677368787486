/// \file
/// Orientations as files write them, and rotation matrices.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// Whether a robot's Chain::orientation says how rx, ry, rz make a rotation: "intrinsic_" or "extrinsic_" and the three
/// axes in the order of the rotations, e.g. "intrinsic_xyz" (R = Rx Ry Rz) or "extrinsic_xyz" (R = Rz Ry Rx).
bool is_orientation(const std::string& convention);

/// Rotation matrices of orientations; `convention` matters for angles only. Quaternions need not have length 1. Throws
/// std::invalid_argument for a convention that is none, and a quaternion of length 0.
std::vector<Eigen::Matrix3d> rotations_of(const Orientation& orientation, const std::string& convention);

/// Rotation matrices as angles in that convention, the middle one from -90 to 90 degrees, or as quaternions with w >= 0
/// if the convention is none.
Orientation to_orientation(const std::vector<Eigen::Matrix3d>& rotations, const std::string& convention);

}  // namespace llmt::robotics
