// What of a robot moved, from its description to the search for movements.
#pragma once

#include <string>
#include <vector>

#include "check/movements.hpp"
#include "llmt/robotics/robot_check.hpp"

namespace llmt::robotics {

/// What the search for movements works on.
struct Linearised {
  std::vector<discovery::Parameter> parameters;  ///< of the columns
  Eigen::Index geometric = 0;                    ///< the first ones, which are of the geometry
  MovementProblem problem;                       ///< without suspects, covariance and level
  std::vector<Eigen::Index> rows;                ///< of the coordinates, 3 for a reading
};

/// `robot` has base and tool fitted to the measurements, `before` those of the calibration. Derivatives are taken at
/// the fitted ones: a target that was mounted elsewhere is far from the old one.
Linearised linearised(const CorrectedRobot& robot, const Robot& before, const Measurements& measurements,
                      const CheckOptions& options);

/// Sets what `result` says of movements and of noise. Robots as for linearised().
void find_moved(const CorrectedRobot& robot, const Robot& before, const Measurements& measurements,
                const CheckOptions& options, RobotCheck& result);

/// Bases of any session, and of any target: "base@tuesday.x" belongs to a base.
bool is_of_base(const std::string& name);

}  // namespace llmt::robotics
