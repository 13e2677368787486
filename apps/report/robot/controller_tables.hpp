/// \file
/// The geometry of an arm as controllers load it.
#pragma once

#include <string>

#include "llmt/robotics/correction.hpp"
#include "report/robot/input_checks.hpp"

namespace llmt::report {

/// YAML with the pose of each joint in the frame of the one before, at zero; m and rad. With `origins_of` each joint
/// has the name that it has there, its origin is the point of its axis that is nearest to the origin there (that origin
/// itself, if the joint is prismatic), and its x axis is turned no farther than the axes differ: Denavit-Hartenberg
/// parameters of nearly parallel axes put the origins up to a hundred metres away. Throws std::invalid_argument if the
/// number or the kinds of joints differ, or an axis differs by 10 degrees or a tenth of the reach.
std::string kinematics_yaml(const robotics::Chain& described, const robotics::Chain* origins_of = nullptr);

/// CSV with the differences of the Denavit-Hartenberg parameters. Throws std::invalid_argument if convention or number
/// of joints differ.
std::string deltas_csv(const robotics::Chain& chain, const robotics::Chain& nominal);

/// What a table of the geometry holds.
struct GeometryChoice {
  const robotics::Chain* deltas_from = nullptr;  ///< deltas_csv() from it; else kinematics_yaml()
  bool zeros = false;                            ///< of deltas: those of the zeros of the joints alone
  const robotics::Chain* origins_of = nullptr;   ///< see kinematics_yaml()
};

/// What a controller takes that knows geometry alone. Where the robot has more than the table, this is fitted anew to
/// the whole model, and `warn` gets how far the tool is off without the rest. It also gets the values that calibration
/// could not determine alone. Throws as deltas_csv() and kinematics_yaml().
std::string geometry_table(const robotics::CorrectedRobot& robot, const GeometryChoice& choice, const Warn& warn);

}  // namespace llmt::report
