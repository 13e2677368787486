/// \file
/// Tables of what an arm does at given joint values, or made up ones.
#pragma once

#include <optional>
#include <string>

#include "llmt/progress.hpp"
#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/simulation.hpp"
#include "report/robot/input_checks.hpp"

namespace llmt::report {

/// Where the robot, its effects and correction put the tool. Columns that effects need are made up and named.
/// `orientation`: the convention of the angles; empty: that of the description, or else quaternions. `file`: of the
/// robot. Throws as check_positions() and robotics::tool_poses().
robotics::Measurements predicted_table(const std::string& file, const robotics::CorrectedRobot& robot,
                                       const robotics::Poses& given, const std::string& orientation, const Warn& warn,
                                       const Progress& progress = {});

/// As robotics::simulate(), at these poses if they are given; the correction is part of what the description says of
/// the robot. `file`: of the robot.
robotics::Measurements simulated_table(const std::string& file, const robotics::CorrectedRobot& robot,
                                       const std::optional<robotics::Poses>& poses,
                                       const robotics::SimulationOptions& options);

}  // namespace llmt::report
