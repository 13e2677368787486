/// \file
/// Whether a calibrated robot is still good, from what was read to the verdict.
#pragma once

#include <string>

#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/robot_check.hpp"
#include "report/robot/check_report.hpp"

namespace llmt::report {

/// The robot to read measurements of one session for, which it need not know: its frames are fitted anyway.
robotics::Robot for_any_session(robotics::Robot robot);

/// Judges a robot, which is for_any_session() unless the session is the same. Throws with the names of the files:
/// NotEvaluated where the measurements are of another robot, or too few, or the description says no accuracy;
/// std::runtime_error where their frames do not suit it.
robotics::RobotCheck run_check(const std::string& robot_file, const std::string& data,
                               const robotics::CorrectedRobot& robot, const robotics::Measurements& measurements,
                               const robotics::CheckOptions& options);

/// Why the robot is no longer good, in a sentence; empty if it is.
std::string check_refusal(const CheckFacts& facts);

}  // namespace llmt::report
