/// \file
/// Measurements and parameters of a robot in the words of a person.
#pragma once

#include <string>
#include <vector>

#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/robot.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

/// "60 poses", or "60 poses, 180 points of 3 targets, 2 sessions".
std::string counts_of(const robotics::Measurements& measurements);

/// The readings that are no orientations: what reports show.
robotics::Measurements points_of(const robotics::Measurements& measurements);

/// "joint5.theta +-0.91 deg, joint5.d +-1.9 mm": robotics::uncertain_parameters(), empty if there are none.
std::string uncertain_text(const robotics::Robot& robot);

/// A sentence on the joints that hardly moved, with their ranges.
std::string still_text(const std::vector<robotics::StillJoint>& still);

/// [{"joint": "joint3", "range": 0.0057, "unit": "deg"}]
Json still_json(const std::vector<robotics::StillJoint>& still);

}  // namespace llmt::report
