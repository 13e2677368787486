// Likely mistakes in a table that cannot be meant as it stands.
#pragma once

#include <string>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// Sum of the lengths of the links without the tool, mm.
double length_of(const Chain& chain);

/// Tries what goes wrong in files: units of angles, of positions, of the description or of one target's points, signs,
/// zeros and order of the joints, an axis of the instrument; one at a time, and signs of several joints together.
/// Returns in a sentence the change with which the described robot, base and tool fitted, misses the points least in
/// relation to their spread, and those that do as well, if that is less than a tenth of the share by which it misses
/// them as they stand, less than a twentieth of the spread, and less than `plausible_share` of the arm's length; else
/// nothing.
std::string input_mistake(const Robot& robot, const Measurements& measurements, double plausible_share);

/// The same of measured orientations: quaternions written x, y, z, w, and rotations from the tool to the world. Returns
/// the change after which the described robot, placed by the positions, turns its tool as measured but for 50 mrad on
/// average and a constant rotation; else nothing.
std::string orientation_mistake(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
