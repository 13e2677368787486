/// \file
/// Joint commands that bring a real arm, as its model describes it, to asked-for poses.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/progress.hpp"
#include "llmt/robotics/correction.hpp"

namespace llmt::robotics {

/// n asked-for poses of the tool in the world frame.
struct Targets {
  /// Joint values from which the search starts, and whose branch (elbow up or down, wrist flipped or not) the commands
  /// keep, and the conditions: payload, temperature, direction of approach.
  Poses start;
  Eigen::MatrixXd positions_mm;                 ///< n x 3
  std::vector<Eigen::Matrix3d> rotations = {};  ///< n, or empty: only positions count
};

/// What became of a target.
enum class Outcome {
  reached,
  jump,         ///< the model jumps there, at a cut of the tree or a reversal of a load: the nearest side was taken
  limit,        ///< a joint would have to go beyond its limit
  unreachable,  ///< too far, or in a direction that no joint moves the tool in
  branch,       ///< reached, but on another branch than the start: a singular pose lies between
  singular      ///< the position is reached; what the orientation misses would cost turns a hundred times as large
};

/// "reached", "jump", "limit", "unreachable", "branch", "singular".
std::string to_string(Outcome outcome);

struct CompensationOptions {
  double tolerance_mm =
      1e-6;  ///< a target counts as reached within this distance, and this over the arm's reach in rad
  int max_iterations = 60;
  Progress progress = {};
};

struct Compensation {
  Poses commands;             ///< the joint values, and the conditions they hold for
  Eigen::VectorXd before_mm;  ///< distance of the model at the start joints from the target
  Eigen::VectorXd after_mm;   ///< at the commands
  Eigen::VectorXd after_deg;  ///< angle between the orientations at the commands; empty without orientations
  std::vector<Outcome> outcomes;
  std::vector<std::string> reasons;    ///< why not reached, in words; empty if it was
  std::vector<std::string> uncovered;  ///< which joints are outside of the correction's training; empty if none
};

/// Commands for every target, by themselves and in their order.
///
/// A step solves, with J the rigid arm's Jacobian by the joints, e what is missing in position and orientation, and q0
/// the start, min |dq| so that J dq = e, damped (Levenberg-Marquardt) where a full step does not lessen |e|. Effects
/// and correction are in e, and change little with q, so each step gains about three digits. Joints that a target
/// leaves free (positions only, more joints than needed) stay as near to q0 as they can. Joints at their limits are
/// left out while they would go beyond; limits hold exactly, of the start as well. A joint that would turn by more than
/// 10 degrees is kept at q0 if the position can be reached so, with a quarter of the turn, and an orientation that
/// misses by at most a hundredth of it (Outcome::singular). Fewer than six joints cannot set an
/// orientation: the rotations are then not used.
///
/// The columns that the effects need and the start does not have are made up by with_approach() and
/// with_needed_columns(), except that qmeasN_... is the command: the arm stands still. Throws std::invalid_argument for
/// wrong shapes and numbers that are not finite, and as positions().
Compensation compensate(const CorrectedRobot& robot, const Targets& targets, const CompensationOptions& options = {});

/// The poses with the columns dirN and moveN_... that the robot's effects need and the poses do not have, as if the arm
/// went from row to row: the sign of each joint's move, +1 in the first row, and where a joint does not move that of
/// the row before; the moves by add_moves(), in the order of the rows.
Poses with_approach(const Robot& robot, Poses poses);

/// Joint values at which the rigid chain of the robot reaches the targets, whose start joints do not matter: the first
/// row the solution nearest to the middle of the joints' ranges that 60 starts find, then each row from the one before,
/// or by starts anew. Rows that cannot be reached hold what comes nearest. The seed is fixed.
Eigen::MatrixXd rigid_joints(const Robot& robot, const Targets& targets, const Progress& progress = {});

}  // namespace llmt::robotics
