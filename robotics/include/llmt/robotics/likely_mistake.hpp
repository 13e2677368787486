/// \file
/// Mistakes in descriptions and tables that would explain why a robot misses its measured points.
///
///     if (const std::optional<Suspicion> found = likely_mistake(robot, measured)) {
///       std::puts(found->sentence.c_str());  // "most likely the values of joint5 are radians, not degrees: ..."
///     }
#pragma once

#include <optional>
#include <string>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// A mistake in description or measurements that explains them better than the robot does.
struct Suspicion {
  std::string name;      ///< for people who know better: "joint5_radians"
  std::string sentence;  ///< with the error that remains without it
};

/// Tries what goes wrong in files: units of angles, lengths, positions or of one target's points; signs, zeros, order
/// and coupling of the joints; an axis of the instrument; the convention of the description; readings that slipped by a
/// row, and an instrument that moved; one at a time, signs of several joints together, and two at once; where positions
/// show none, the order of angles and quaternions, if orientations are fitted. Returns the
/// change with which the described robot, base and tool fitted, misses the points least in relation to their spread, if
/// that is less than a tenth of the share by which it misses them as they stand, less than a twentieth of the spread,
/// and less than a fiftieth of the arm's length; else nothing. However small the misfit is: a joint of the wrist moves
/// the tool little. Nothing for fewer than 10 different poses, and where the misfit is below a millionth of the arm's
/// length. Lengths in mm, joints in rad; what cannot be placed counts as no explanation, nothing is thrown for it.
std::optional<Suspicion> likely_mistake(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
