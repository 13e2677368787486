/// \file
/// A robot model: a chain with its effects, evaluated over many poses.
///
///     const Eigen::MatrixXd tool_mm = positions(robot, measured.poses);  // effects included
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/discovery/least_squares.hpp"
#include "llmt/robotics/effects.hpp"
#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

/// Largest coordinate of a tool position that is taken for a position, mm. Squares of larger ones lose all meaning.
inline constexpr double farthest_mm = 1e15;

/// Throws std::invalid_argument: see validate(Chain), unknown effects, non-finite effect values, an effect named twice
/// at one place, more than 1000 effects or 10 000 values of all effects, joint ranges of a calibration that are not one
/// for each joint.
void validate(const Robot& robot);

/// All parameters: geometry (see geometric_parameters()), then the effects' in order, named as by
/// effect_parameter_name().
std::vector<discovery::Parameter> parameters(const Robot& robot);

/// The robot with those values, in the order of parameters().
Robot with_values(Robot robot, const Eigen::VectorXd& values);

/// The robot without effects that are errors of the instrument or its session (EffectType::of_measuring), such as a
/// drift: what the arm does by itself. What was identified is forgotten with them.
Robot without_errors_of_measuring(Robot robot);

/// The identified lengths and angles with a standard error above 0.5 mm or 0.1 degrees. The measured poses do not
/// determine each of these alone: other values, changed together, give the same positions there. Empty before
/// calibration.
std::vector<IdentifiedParameter> uncertain_parameters(const Robot& robot);

/// What an instrument would read, n x 3, mm: tool positions in the world frame, or what Poses::observations say.
/// Throws std::invalid_argument if the number of joints does not match, a column that an effect needs is missing, or an
/// observation names a base or tool that the chain does not have.
Eigen::MatrixXd positions(const Robot& robot, const Poses& poses);

/// Tool poses in the world frame, n of them, with the base and the tool of each row. The positions are those of
/// positions(); links and joints that bend turn the tool as well. Throws as positions().
std::vector<Pose> tool_poses(const Robot& robot, const Poses& poses);

/// Why the positions() make no sense, or nothing if they do: the first pose, counted from 1, at which one is not finite
/// or beyond farthest_mm, and the effect that makes it so. Numbers of a description may be finite and their products
/// not, and an expression may divide by zero. Throws as positions().
std::string position_refusal(const Robot& robot, const Poses& poses);

/// Derivatives of positions() by the joint values of the rigid arm, 3n x J: rows as in position_jacobian(), per rad or
/// mm.
Eigen::MatrixXd joint_motions(const Robot& robot, const Poses& poses);

/// Derivatives of positions() by parameters(), 3n x P: rows x, y, z of pose 0, then of pose 1, ...
/// They are those of the arm in equilibrium: a change of geometry, payload or gravity changes loads, deflections, and
/// the loads again. The relative error is of the size (deflection / length)^3, what the passes to equilibrium leave.
/// Where an effect jumps, as a backlash does, the derivative is that beside the jump.
Eigen::MatrixXd position_jacobian(const Robot& robot, const Poses& poses);

/// The same by some of parameters() only, given by their different numbers: 3n x (number of columns), in their order.
/// Takes less time the fewer there are.
Eigen::MatrixXd position_jacobian(const Robot& robot, const Poses& poses, const std::vector<Eigen::Index>& columns);

/// Load of each joint by the weight of arm and payload in the rigid pose, n x J: the torque z_j . moment in N m, or the
/// force z_j . force in N for a prismatic joint. Effects that change payload or gravity are included.
Eigen::MatrixXd gravity_loads(const Robot& robot, const Poses& poses);

/// First-order changes of positions() by candidates that are not in the robot: 3n x (sum of their numbers of
/// values), derivatives by each candidate's values at 0 (whatever its values are), rows as in position_jacobian() and
/// as exact. The robot's own effects answer what a candidate changes of loads, payload and gravity. Throws
/// std::invalid_argument as positions() and effect_index().
Eigen::MatrixXd effect_signatures(const Robot& baseline, const std::vector<Effect>& candidates, const Poses& poses);

/// Whether the poses have the columns that an effect of that type at that place needs; if not, `missing` names the
/// first that is not there.
bool has_columns(const EffectType& type, const Chain& chain, std::size_t index, const Poses& poses,
                 std::string* missing = nullptr);

}  // namespace llmt::robotics
