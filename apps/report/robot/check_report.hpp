/// \file
/// Whether a calibrated robot is still good, as text and as JSON.
#pragma once

#include <string>

#include "llmt/robotics/robot_check.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

/// What was checked by what, and the outcome.
struct CheckFacts {
  std::string robot_file;
  std::string data;  ///< the name of the table of measurements
  const robotics::Robot& robot;
  const robotics::Measurements& measurements;
  const robotics::CheckOptions& options;
  const robotics::RobotCheck& check;
  Face face = {};
};

/// Still good or not, with the error and the limit, in two sentences.
std::string check_summary(const CheckFacts& facts);
/// For people: still good or not, what moved, what the poses do not show.
std::string check_text(const CheckFacts& facts);
Json check_json(const CheckFacts& facts);

}  // namespace llmt::report
