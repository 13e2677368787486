// What in a description or in measurements may be the user's own mistake, and where the model is not covered by data.
#pragma once

#include "discovery/investigation.hpp"
#include "llmt/robotics/discovery_result.hpp"

namespace llmt::robotics {

/// Adds notes to the result, each a sentence or two:
///
/// - payloads that no arm of this weight carries: grams for kilograms;
/// - gravity along another axis of the base explains what is left far better: the arm hangs or stands on a wall;
/// - effects of the description that the data put at zero;
/// - joints that the test poses move further than the poses searched, with the standard deviation of the model's own
///   position there and inside.
void add_doubts(const Robot& described, const Investigation& investigation, const Measurements& test,
                Discovery& result);

}  // namespace llmt::robotics
