#include "llmt/robotics/compensation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "compensation/inverse.hpp"
#include "correction/correction_twist.hpp"
#include "kinematics/units.hpp"
#include "llmt/robotics/effects.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robot/robot_evaluator.hpp"

namespace llmt::robotics {
namespace {

constexpr Eigen::Index joints_of_a_pose = 6;

void check(const Robot& robot, const Targets& targets) {
  const Eigen::Index count = targets.start.count();
  const auto refuse = [](const std::string& message) {
    throw std::invalid_argument("llmt::robotics::compensate: " + message);
  };
  if (targets.start.joints.cols() != std::ssize(robot.chain.joints)) {
    refuse(fmt::format("the start has {} joints, robot \"{}\" has {}", targets.start.joints.cols(), robot.chain.name,
                       robot.chain.joints.size()));
  }
  if (targets.positions_mm.rows() != count || targets.positions_mm.cols() != 3) {
    refuse(fmt::format("positions_mm is {} x {}, must be {} x 3", targets.positions_mm.rows(),
                       targets.positions_mm.cols(), count));
  }
  if (!targets.rotations.empty() && std::ssize(targets.rotations) != count) {
    refuse(fmt::format("there are {} rotations, must be {}", targets.rotations.size(), count));
  }
  if (!targets.positions_mm.allFinite() || !targets.start.joints.allFinite()) refuse("a number is not finite");
}

Goal goal_of(const Robot& robot, const Targets& targets, Eigen::Index row) {
  Goal goal{.position_mm = targets.positions_mm.row(row).transpose(), .rotation = std::nullopt};
  const bool can_turn = drive_count(robot.chain) >= joints_of_a_pose;
  if (can_turn && !targets.rotations.empty()) goal.rotation = targets.rotations[row];
  return goal;
}

// The whole model at one row of conditions, at joint values that change.
class Arm {
 public:
  Arm(const CorrectedRobot& robot, const Poses& conditions, std::vector<std::pair<std::string, Eigen::Index>> read_back)
      : robot_(robot), poses_(conditions), read_back_(std::move(read_back)), evaluator_(robot.robot, poses_) {
    if (!robot.correction) return;
    correction_.emplace(*robot.correction, robot.robot.chain);
    base_rotation_ = base_rotation_of(robot.robot.chain);
  }

  Pose at(Eigen::Index row, const Eigen::VectorXd& q) {
    poses_.joints.row(row) = q.transpose();
    for (const auto& [column, joint] : read_back_) poses_.covariates.at(column)(row) = q(joint);
    Pose pose = evaluator_.pose(row);
    if (!correction_) return pose;
    return moved(std::move(pose), correction_->at(q.transpose(), 1).row(0).transpose(), base_rotation_,
                 Eigen::Vector3d::Zero());
  }

  const Poses& poses() const { return poses_; }

 private:
  const CorrectedRobot& robot_;
  Poses poses_;  // own: the joint values follow the search
  std::vector<std::pair<std::string, Eigen::Index>> read_back_;
  RobotEvaluator evaluator_;
  Eigen::Matrix3d base_rotation_ = Eigen::Matrix3d::Identity();
  std::optional<CorrectionTwist> correction_;
};

struct Found {
  Inverse::Solution solution;
  Outcome outcome = Outcome::reached;
  std::string reason;
};

std::string joint_names(const Chain& chain, const std::vector<std::size_t>& joints) {
  std::vector<std::string> names;
  for (const std::size_t joint : joints) names.push_back(chain.joints[joint].name);
  return fmt::format("{}", fmt::join(names, ", "));
}

// The solution, with the reason if the target was not reached. If the model's change of the rigid arm is held as it is
// at the best point, the arm is smooth: if that one reaches the target, the model jumps between.
Found judged(const Chain& chain, const Inverse& inverse, const Goal& goal, Inverse::Solution best,
             const Inverse::Forward& forward) {
  const Pose rigid = inverse.rigid().forward(best.q);
  const Pose whole = forward(best.q);
  const Eigen::Vector3d shift = whole.position_mm - rigid.position_mm;
  const Eigen::Matrix3d turn = whole.rotation * rigid.rotation.transpose();
  const auto frozen = [&](const Eigen::VectorXd& q) {
    const Pose pose = inverse.rigid().forward(q);
    return Pose{pose.position_mm + shift, turn * pose.rotation};
  };
  const Inverse::Solution smooth = inverse.solve(goal, best.q, frozen);
  if (smooth.converged) {
    // The best point of the way to there, found by halving.
    const Eigen::VectorXd from = best.q;
    for (double share = 1.0; share > 1e-12; share *= 0.5) {
      const Eigen::VectorXd q = from + share * (smooth.q - from);
      const double error = missing(goal, forward(q), inverse.lever_mm()).norm();
      if (error < best.error_mm) best = {q, error, false};
    }
    return {best, Outcome::jump, "the model jumps here, the nearer side is taken"};
  }
  const std::vector<std::size_t> limited = inverse.at_limits(best.q);
  if (!limited.empty()) return {best, Outcome::limit, "at the limit of " + joint_names(chain, limited)};
  return {best, Outcome::unreachable, "out of the arm's reach, or in a direction in which no joint moves the tool"};
}

// Distance in mm and angle in degrees.
std::pair<double, double> distances_of(const Goal& goal, const Pose& pose) {
  const Eigen::VectorXd error = missing(goal, pose, 1.0);
  return {error.head(3).norm(), goal.rotation ? error.tail(3).norm() / radians : 0.0};
}

// Two axes nearly coincide in a stretched wrist. There the last hundredths of a degree of an orientation cost turns of
// tens of degrees, or end the search. If the position can be reached without these turns, the joint that would turn
// most is held.
std::optional<Found> without_large_turn(const Chain& chain, const Inverse& inverse, const Goal& goal,
                                        const Eigen::VectorXd& start, const Inverse::Forward& forward,
                                        const Inverse::Solution& exact) {
  constexpr double large = 10.0 * radians;
  constexpr double most_missed = 0.01;  // of the turn
  constexpr double smaller = 0.25;
  Eigen::Index joint = 0;
  const double needed = (exact.q - start).cwiseAbs().maxCoeff(&joint);
  const bool is_large = needed >= large && chain.joints[joint].type == JointType::revolute;
  if (!goal.rotation || (exact.converged && !is_large)) return {};
  const Inverse held = is_large ? inverse.holding(joint, start(joint)) : inverse;
  const Eigen::VectorXd near = is_large ? held.solve(goal, start, forward).q : exact.q;
  const Inverse::Solution there = held.solve({goal.position_mm, std::nullopt}, near, forward);
  const double missed_deg = distances_of(goal, forward(there.q)).second;
  const double turn = std::max(needed, large);
  const bool is_still = (there.q - start).cwiseAbs().maxCoeff() < smaller * turn;
  if (!there.converged || !is_still || missed_deg > most_missed * turn / radians) return {};
  const std::string kept =
      is_large ? fmt::format("{} is kept, it would turn by {:.2g} deg", chain.joints[joint].name, turn / radians)
               : "the joints turn little";
  return Found{there, Outcome::singular,
               fmt::format("near a singular pose {}; the orientation misses by {:.2g} deg", kept, missed_deg)};
}

Found one_target(const Chain& chain, const Inverse& inverse, const Goal& goal, const Eigen::VectorXd& start,
                 const Inverse::Forward& forward) {
  Found found{.solution = inverse.solve(goal, start, forward), .outcome = Outcome::reached, .reason = ""};
  const Eigen::VectorXd inside = inverse.within_limits(start);
  const auto still = [&] { return without_large_turn(chain, inverse, goal, inside, forward, found.solution); };
  if (!found.solution.converged) {
    Found missed = judged(chain, inverse, goal, found.solution, forward);
    return missed.outcome == Outcome::unreachable ? still().value_or(std::move(missed)) : missed;
  }
  if (std::optional<Found> kept = still()) return *std::move(kept);
  const bool turns = goal.rotation.has_value();
  if (inverse.branch(found.solution.q, turns) * inverse.branch(inside, turns) < 0) {
    found.outcome = Outcome::branch;
    found.reason = "a singular pose lies between the start and the command";
  }
  return found;
}

std::string outside_of_training(const CorrectedRobot& robot, const Eigen::VectorXd& q) {
  if (!robot.correction) return "";
  std::vector<std::string> names;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const InputColumn& seen = inputs_of(*robot.correction)[j];
    if (q(j) >= seen.low && q(j) <= seen.high) continue;
    const Joint& joint = robot.robot.chain.joints[j];
    const double unit = to_limit_unit(joint);
    names.push_back(fmt::format("{} at {:.6g}, trained from {:.6g} to {:.6g} {}", joint.name, q(j) * unit,
                                seen.low * unit, seen.high * unit, limit_unit(joint)));
  }
  return fmt::format("{}", fmt::join(names, "; "));
}

// Columns of the joint values that the controller would read back: those that were made up.
std::vector<std::pair<std::string, Eigen::Index>> made_up_read_backs(const Poses& given, const Poses& completed) {
  std::vector<std::pair<std::string, Eigen::Index>> columns;
  for (const auto& [name, values] : completed.covariates) {
    if (!name.starts_with("qmeas") || given.covariates.contains(name)) continue;
    columns.emplace_back(name, std::stol(name.substr(5)) - 1);
  }
  return columns;
}

void fill_directions(Eigen::VectorXd& direction, const Eigen::VectorXd& joint) {
  direction = Eigen::VectorXd::Ones(joint.size());
  for (Eigen::Index row = 1; row < joint.size(); ++row) {
    const double move = joint(row) - joint(row - 1);
    direction(row) = move > 0.0 ? 1.0 : move < 0.0 ? -1.0 : direction(row - 1);
  }
}

}  // namespace

std::string to_string(Outcome outcome) {
  static const std::array<const char*, 6> names = {"reached", "jump", "limit", "unreachable", "branch", "singular"};
  return names.at(static_cast<std::size_t>(outcome));
}

Poses with_approach(const Robot& robot, Poses poses) {
  for (const Effect& effect : robot.effects) {
    for (const std::string& names : effect_columns(robot.chain, effect)) {
      if (find_column(poses, names) != nullptr) continue;
      if (names.starts_with("dir")) {
        fill_directions(poses.covariates[names], poses.joints.col(std::stol(names.substr(3)) - 1));
      } else if (is_move(names)) {
        Poses ordered{.joints = poses.joints, .covariates = {}};
        ordered.covariates["order"] =
            Eigen::VectorXd::LinSpaced(poses.count(), 1.0, static_cast<double>(poses.count()));
        add_moves(ordered, robot.chain);
        ordered.covariates.erase("order");
        poses.covariates.merge(ordered.covariates);
      }
    }
  }
  return poses;
}

Compensation compensate(const CorrectedRobot& robot, const Targets& targets, const CompensationOptions& options) {
  check(robot.robot, targets);
  Work work(options.progress);
  const Chain& chain = robot.robot.chain;
  const Eigen::Index count = targets.start.count();
  Poses conditions = with_needed_columns(robot.robot, with_approach(robot.robot, targets.start), 1);
  Compensation result{.commands = conditions,
                      .before_mm = Eigen::VectorXd::Zero(count),
                      .after_mm = Eigen::VectorXd::Zero(count),
                      .after_deg = {},
                      .outcomes = {},
                      .reasons = {},
                      .uncovered = {}};
  if (count == 0) return result;
  Arm arm(robot, conditions, made_up_read_backs(targets.start, conditions));
  const Inverse inverse(chain, options.tolerance_mm, options.max_iterations);
  Eigen::VectorXd angles = Eigen::VectorXd::Zero(count);
  bool turns = false;
  for (Eigen::Index row = 0; row < count; ++row) {
    const auto forward = [&](const Eigen::VectorXd& q) { return arm.at(row, q); };
    const Eigen::VectorXd start = targets.start.joints.row(row).transpose();
    const Goal goal = goal_of(robot.robot, targets, row);
    turns = turns || goal.rotation.has_value();
    result.before_mm(row) = distances_of(goal, forward(start)).first;
    const Found found = one_target(chain, inverse, goal, start, forward);
    std::tie(result.after_mm(row), angles(row)) = distances_of(goal, forward(found.solution.q));
    result.commands.joints.row(row) = found.solution.q.transpose();
    result.outcomes.push_back(found.outcome);
    result.reasons.push_back(found.reason);
    result.uncovered.push_back(outside_of_training(robot, found.solution.q));
    work.did(1.0 / static_cast<double>(count));
  }
  for (auto& [name, values] : result.commands.covariates) values = arm.poses().covariates.at(name);
  if (turns) result.after_deg = angles;
  work.finish();
  return result;
}

}  // namespace llmt::robotics
