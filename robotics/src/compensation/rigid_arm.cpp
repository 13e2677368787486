#include "llmt/robotics/rigid_arm.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "llmt/random.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/simulation.hpp"

namespace llmt::robotics {

Measurements points_of_model(const CorrectedRobot& robot, Eigen::Index count) {
  const Chain& chain = robot.robot.chain;
  const auto& record = robot.robot.calibration;
  Random random(1);
  Poses poses;
  poses.joints.resize(count, std::ssize(chain.joints));
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const Joint& joint = chain.joints[j];
    const double half_turn = joint.type == JointType::revolute ? 180.0 : 0.0;
    const bool has_range = record && j < record->joint_ranges.size();
    const auto [low, high] =
        has_range ? record->joint_ranges[j] : joint.limits.value_or(std::array{-half_turn, half_turn});
    for (Eigen::Index row = 0; row < count; ++row) {
      poses.joints(row, static_cast<Eigen::Index>(j)) = random.uniform(low, high) / to_limit_unit(joint);
    }
  }
  Measurements seen;
  seen.poses = with_needed_columns(robot.robot, with_approach(robot.robot, poses), 1);
  if (const std::string refusal = position_refusal(robot.robot, seen.poses); !refusal.empty()) {
    throw std::runtime_error("llmt::robotics::points_of_model: " + refusal);
  }
  seen.positions_mm = positions(robot, seen.poses);
  return seen;
}

Chain with_fitted_frames(Chain nominal, const CorrectedRobot& robot) {
  Robot placed;
  placed.chain = std::move(nominal);
  placed.chain.base = robot.robot.chain.base;
  placed.chain.tool = robot.robot.chain.tool;
  register_frames(placed, points_of_model(robot));
  return placed.chain;
}

Chain fitted_to_model(Chain start, const CorrectedRobot& robot, const std::vector<std::string>& only) {
  Robot fitted;
  fitted.chain = std::move(start);
  fitted.chain.base = robot.robot.chain.base;
  fitted.chain.tool = robot.robot.chain.tool;
  CalibrationOptions options;
  options.only = only;
  return calibrate(fitted, points_of_model(robot), options).robot.chain;
}

Robot geometry_alone(const CorrectedRobot& robot) {
  if (robot.robot.effects.empty() && !robot.correction) return robot.robot;
  Robot plain = robot.robot;
  plain.effects.clear();
  plain.correction_file.clear();
  const std::vector<discovery::Parameter> geometry = geometric_parameters(plain.chain);
  std::vector<std::string> only;
  for (const IdentifiedParameter& entry : robot.robot.identified) {
    const bool is_geometry = std::ranges::find(geometry, entry.name, &discovery::Parameter::name) != geometry.end();
    if (entry.standard_error && is_geometry) only.push_back(entry.name);
  }
  if (!only.empty()) plain.chain = fitted_to_model(plain.chain, robot, only);
  return plain;
}

}  // namespace llmt::robotics
