// Units that a file of measurements most likely has, where it says others.
#pragma once

#include <string>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// If the described robot, free in base and tool, misses the measurements by `misfit_mm` on average, and by less than a
/// tenth of that and `plausible_mm` with angles taken for radians instead of degrees, or degrees instead of radians, or
/// with positions of a thousand times or a thousandth the size: which, in a sentence. Else empty.
std::string likely_units(const Robot& robot, const Measurements& measurements, double misfit_mm, double plausible_mm);

}  // namespace llmt::robotics
