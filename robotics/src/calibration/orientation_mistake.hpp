// Orientations that were written in another way than they are read.
#pragma once

#include <optional>
#include <string>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// As Suspicion.
struct OrientationMistake {
  std::string name;
  std::string sentence;
};

/// Tries the six orders of rotations about x, y and z, rotations of the instrument's frame in the tool's, and
/// quaternions whose w stands last. Base and tool point are those that the positions tell; a right orientation then
/// differs from the tool's by the same rotation in every pose. Returns the way in which these rotations scatter least,
/// if that is less than a tenth of how they scatter as they are read, and less than 3 degrees. Nothing for fewer than
/// 10 orientations, or positions that place no robot.
std::optional<OrientationMistake> likely_orientation_mistake(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
