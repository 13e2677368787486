// The gap between model and measurement: a tree of the residuals.
#pragma once

#include "llmt/robotics/discovery/discovery_result.hpp"

namespace llmt::robotics {

/// The gap of the robot: its largest regions, the joints whose motion it resembles, and the inputs that it depends on.
GapMap gap_map(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
