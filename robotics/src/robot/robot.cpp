#include "llmt/robotics/robot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <stdexcept>
#include <utility>

#include "llmt/limits.hpp"
#include "robot/checks.hpp"
#include "robot/robot_evaluator.hpp"
#include "robot/settings.hpp"

namespace llmt::robotics {

namespace {

// The numbers in the whole table of a setting's rows.
class Rows {
 public:
  Rows(Eigen::Index count, const std::vector<Eigen::Index>* rows) : count_(count), rows_(rows) {}
  Eigen::Index count() const { return count_; }
  Eigen::Index operator[](Eigen::Index i) const { return rows_ == nullptr ? i : (*rows_)[i]; }

 private:
  Eigen::Index count_;
  const std::vector<Eigen::Index>* rows_;  // null: all
};

// Calls evaluate(evaluator, rows) once for every base and tool.
template <typename Evaluate>
void in_settings(const Robot& robot, const Poses& poses, Evaluate evaluate) {
  if (is_one_setting(robot, poses)) {
    RobotEvaluator evaluator(robot, poses);
    evaluate(evaluator, Rows(poses.count(), nullptr));
    return;
  }
  for (const Setting& setting : settings_of(robot, poses)) {
    RobotEvaluator evaluator(setting);
    evaluate(evaluator, Rows(setting.poses.count(), &setting.rows));
  }
}

}  // namespace

void validate(const Chain& chain, const Effect& effect) {
  effect_index(chain, effect);
  for (const std::vector<double>* numbers : {&effect.values, &effect.constants}) {
    if (!std::ranges::all_of(*numbers, [](double value) { return std::isfinite(value); }))
      throw std::invalid_argument("llmt::robotics::Robot: a number of " + effect_label(effect) + " is not finite");
  }
}

void validate(const Robot& robot) {
  validate(robot.chain);
  std::set<std::string> seen;
  std::size_t values = 0;
  for (const Effect& effect : robot.effects) {
    validate(robot.chain, effect);
    if (!seen.insert(effect_label(effect)).second) {
      throw std::invalid_argument(fmt::format("llmt::robotics::Robot: effect {} is there twice", effect_label(effect)));
    }
    values += effect.values.size();
  }
  if (std::ssize(robot.effects) > most(Limit::robot_effects) ||
      std::cmp_greater(values, most(Limit::robot_effect_values))) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::Robot: {} effects with {} values, at most {} with {} are possible",
                    robot.effects.size(), values, most(Limit::robot_effects), most(Limit::robot_effect_values)));
  }
  const std::size_t ranges = robot.calibration ? robot.calibration->joint_ranges.size() : 0;
  if (ranges != 0 && ranges != robot.chain.joints.size()) {
    throw std::invalid_argument(fmt::format("llmt::robotics::Robot: calibration has {} joint_ranges of {} joints",
                                            ranges, robot.chain.joints.size()));
  }
}

std::vector<discovery::Parameter> parameters(const Robot& robot) {
  std::vector<discovery::Parameter> all = geometric_parameters(robot.chain);
  for (const Effect& effect : robot.effects) {
    const std::vector<EffectParameter> own = effect_parameters(robot.chain, effect);
    for (std::size_t k = 0; k < own.size(); ++k) {
      all.push_back({.name = effect_parameter_name(effect, own[k]),
                     .unit = own[k].unit,
                     .value = effect.values[k],
                     .scale = own[k].scale});
    }
  }
  return all;
}

Robot with_values(Robot robot, const Eigen::VectorXd& values) {
  const Eigen::Index geometric = geometric_parameter_count(robot.chain);
  Eigen::Index expected = geometric;
  for (const Effect& effect : robot.effects) expected += std::ssize(effect.values);
  if (values.size() != expected) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::with_values: values has {} entries, must be {}", values.size(), expected));
  }
  robot.chain = with_geometric_values(std::move(robot.chain), values.head(geometric));
  Eigen::Index next = geometric;
  for (Effect& effect : robot.effects) {
    for (double& value : effect.values) value = values(next++);
  }
  return robot;
}

Robot without_errors_of_measuring(Robot robot) {
  const auto is_of_measuring = [](const Effect& effect) { return effect_type(effect.type).of_measuring; };
  if (std::ranges::none_of(robot.effects, is_of_measuring)) return robot;
  std::erase_if(robot.effects, is_of_measuring);
  robot.identified.clear();
  if (robot.calibration) robot.calibration->correlations.resize(0, 0);
  return robot;
}

std::vector<IdentifiedParameter> uncertain_parameters(const Robot& robot) {
  constexpr double most_mm = 0.5;
  constexpr double most_deg = 0.1;
  const std::vector<discovery::Parameter> all = geometric_parameters(robot.chain);
  std::vector<IdentifiedParameter> uncertain;
  for (const IdentifiedParameter& one : robot.identified) {
    const auto known = std::ranges::find(all, one.name, &discovery::Parameter::name);
    if (known == all.end() || !one.standard_error) continue;
    if (*one.standard_error > (known->unit == "deg" ? most_deg : most_mm)) uncertain.push_back(one);
  }
  return uncertain;
}

Eigen::MatrixXd positions(const Robot& robot, const Poses& poses) {
  Eigen::MatrixXd result(poses.count(), 3);
  in_settings(robot, poses, [&](RobotEvaluator& evaluator, const Rows& rows) {
    for (Eigen::Index i = 0; i < rows.count(); ++i) result.row(rows[i]) = evaluator.reading(i).transpose();
  });
  return result;
}

std::vector<Pose> tool_poses(const Robot& robot, const Poses& poses) {
  std::vector<Pose> result(poses.count());
  in_settings(robot, poses, [&](RobotEvaluator& evaluator, const Rows& rows) {
    for (Eigen::Index i = 0; i < rows.count(); ++i) result[rows[i]] = evaluator.pose(i);
  });
  return result;
}

std::string position_refusal(const Robot& robot, const Poses& poses) {
  const auto acceptable = [](const auto& points) { return (points.array().abs() <= farthest_mm).all(); };
  const Eigen::MatrixXd all = positions(robot, poses);
  Eigen::Index row = 0;
  while (row < all.rows() && acceptable(all.row(row))) ++row;
  if (row == all.rows()) return "";
  const Poses pose = select(poses, {row});
  Robot part = robot;
  part.effects.clear();
  std::string cause = "the geometry";
  for (auto next = robot.effects.begin(); acceptable(positions(part, pose)) && next != robot.effects.end(); ++next) {
    part.effects.push_back(*next);
    cause = "effect " + effect_label(*next);
  }
  return fmt::format(
      "the tool position of pose {} is {}, {}, {} mm, which is not finite or beyond {:g} mm; {} makes it so", row + 1,
      all(row, 0), all(row, 1), all(row, 2), farthest_mm, cause);
}

Eigen::MatrixXd joint_motions(const Robot& robot, const Poses& poses) {
  Eigen::MatrixXd result(3 * poses.count(), poses.joints.cols());
  in_settings(robot, poses, [&](RobotEvaluator& evaluator, const Rows& rows) {
    for (Eigen::Index i = 0; i < rows.count(); ++i) result.middleRows(3 * rows[i], 3) = evaluator.joint_motion(i);
  });
  return result;
}

namespace {

// Into the rows of a setting, by the parameters(robot) with the numbers `columns`.
void add_derivatives(const Robot& robot, const Setting& setting, const std::vector<Eigen::Index>& columns,
                     Eigen::MatrixXd& result) {
  RobotEvaluator evaluator(setting);
  const std::vector<Eigen::Index> of_setting = columns_of(setting, robot);
  std::vector<Eigen::Index> own;     // parameters of the setting's robot
  std::vector<Eigen::Index> places;  // of these in the result
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const auto found = std::ranges::find(of_setting, columns[k]);
    if (found == of_setting.end()) continue;
    own.push_back(found - of_setting.begin());
    places.push_back(static_cast<Eigen::Index>(k));
  }
  const auto radius = std::ranges::find(columns, setting.radius) - columns.begin();
  Eigen::Matrix3Xd part(3, std::ssize(own));
  for (std::size_t i = 0; i < setting.rows.size(); ++i) {
    evaluator.jacobian(static_cast<Eigen::Index>(i), own, part);
    for (std::size_t k = 0; k < places.size(); ++k) {
      result.col(places[k]).segment<3>(3 * setting.rows[i]) = part.col(static_cast<Eigen::Index>(k));
    }
    if (radius < std::ssize(columns)) result(3 * setting.rows[i], radius) = -1.0;
  }
}

}  // namespace

Eigen::MatrixXd position_jacobian(const Robot& robot, const Poses& poses) {
  std::vector<Eigen::Index> all(parameters(robot).size());
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  return position_jacobian(robot, poses, all);
}

Eigen::MatrixXd position_jacobian(const Robot& robot, const Poses& poses, const std::vector<Eigen::Index>& columns) {
  if (is_one_setting(robot, poses)) {
    RobotEvaluator evaluator(robot, poses);
    Eigen::MatrixXd result(3 * poses.count(), std::ssize(columns));
    for (Eigen::Index i = 0; i < poses.count(); ++i) evaluator.jacobian(i, columns, result.middleRows<3>(3 * i));
    return result;
  }
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3 * poses.count(), std::ssize(columns));
  for (const Setting& setting : settings_of(robot, poses)) {
    add_derivatives(robot, setting, columns, result);
  }
  return result;
}

Eigen::MatrixXd gravity_loads(const Robot& robot, const Poses& poses) {
  Eigen::MatrixXd result(poses.count(), poses.joints.cols());
  in_settings(robot, poses, [&](RobotEvaluator& evaluator, const Rows& rows) {
    for (Eigen::Index i = 0; i < rows.count(); ++i) result.row(rows[i]) = evaluator.gravity_loads(i).transpose();
  });
  return result;
}

Eigen::MatrixXd effect_signatures(const Robot& baseline, const std::vector<Effect>& candidates, const Poses& poses) {
  Eigen::Index columns = 0;
  for (const Effect& candidate : candidates) columns += std::ssize(candidate.values);
  Eigen::MatrixXd result(3 * poses.count(), columns);
  Eigen::Matrix3Xd one(3, columns);
  in_settings(baseline, poses, [&](RobotEvaluator& evaluator, const Rows& rows) {
    std::vector<PreparedEffect> prepared;
    for (const Effect& candidate : candidates) {
      prepared.push_back(prepare(evaluator.robot().chain, candidate, evaluator.poses()));
    }
    for (Eigen::Index i = 0; i < rows.count(); ++i) {
      evaluator.signatures(i, prepared, one);
      result.middleRows(3 * rows[i], 3) = one;
    }
  });
  return result;
}

bool has_columns(const EffectType& type, const Chain& chain, std::size_t index, const Poses& poses,
                 std::string* missing) {
  const Effect effect = make_effect(type, chain, index);
  for (const std::string& names : effect_columns(chain, effect)) {
    if (find_column(poses, names) != nullptr) continue;
    if (missing != nullptr) *missing = names;
    return false;
  }
  return true;
}

}  // namespace llmt::robotics
