// What a table that cannot be meant as it stands was probably meant as.
#pragma once

#include <string>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// Tries what goes wrong in files: units of angles, of positions or of one target's, signs, zeros and order of the
/// joints, an axis of the instrument; one at a time, and signs of several joints together. Returns in a sentence the
/// change with which the described robot, base and tool fitted, misses the points least, if that is less than
/// `plausible_mm`, a tenth of what it misses them by as they stand and a twentieth of the spread of the points; else
/// nothing.
std::string likely_mistake(const Robot& robot, const Measurements& measurements, double plausible_mm);

/// The same of measured orientations: quaternions written x, y, z, w, and rotations from the tool to the world. Returns
/// the change after which the described robot, placed by the positions, turns its tool as measured but for 50 mrad on
/// average and a constant rotation; else nothing.
std::string likely_orientation_mistake(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
