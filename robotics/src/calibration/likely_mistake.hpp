// What a table that cannot be meant as it stands was probably meant as.
#pragma once

#include <string>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// Tries what goes wrong in files: units of angles or positions, signs, zeros and order of the joints, an axis of the
/// instrument; one at a time, and signs of several joints together. Returns in a sentence the change with which the
/// described robot, base and tool fitted, misses the points least, if that is less than `plausible_mm`, a tenth of
/// `misfit_mm` and a twentieth of the spread of the points; else nothing.
std::string likely_mistake(const Robot& robot, const Measurements& measurements, double misfit_mm, double plausible_mm);

}  // namespace llmt::robotics
