/// \file
/// The geometry of an arm as controllers load it.
#pragma once

#include <string>

#include "llmt/robotics/correction.hpp"
#include "report/robot/input_checks.hpp"

namespace llmt::report {

/// YAML with the pose of each joint in the frame of the one before, at zero; m and rad.
std::string kinematics_yaml(const robotics::Chain& described);

/// CSV with the differences of the Denavit-Hartenberg parameters. Throws std::invalid_argument if convention or number
/// of joints differ.
std::string deltas_csv(const robotics::Chain& chain, const robotics::Chain& nominal);

/// What a controller takes that knows geometry alone: kinematics_yaml(), or deltas_csv() from a nominal chain; of
/// `zeros` alone, if the controller takes mastering offsets and no more. Where the robot has more than the table, this
/// is fitted anew to the whole model, and `warn` gets how far the tool is off without the rest. It also gets the values
/// that calibration could not determine alone. Throws as deltas_csv().
std::string geometry_table(const robotics::CorrectedRobot& robot, const robotics::Chain* nominal, bool zeros,
                           const Warn& warn);

}  // namespace llmt::report
