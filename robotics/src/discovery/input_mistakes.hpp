// Likely mistakes in a description or in measurements, and poses that the data do not cover.
#pragma once

#include <string>
#include <vector>

#include "discovery/investigation/investigation.hpp"

namespace llmt::robotics {

/// Notes of a sentence or two:
///
/// - payloads that no arm of this weight carries: grams for kilograms;
/// - gravity along another axis of the base explains what is left far better: the arm hangs or stands on a wall;
/// - effects of the description that the data put at zero;
/// - joints that the test poses move further than the poses searched, with the standard deviation of the model's own
///   position there and inside.
///
/// Gravity is tried only if something is missing (`nothing_is_missing` is false).
std::vector<std::string> input_mistakes(const Robot& described, const Investigation& investigation,
                                        const Measurements& test, bool nothing_is_missing);

}  // namespace llmt::robotics
