// Derivatives of the reading by parameters of the arm and by values of effects, which are effects of the arm or
// candidates. robot_levers.cpp has what they are made of.
#include <algorithm>
#include <cmath>
#include <limits>

#include "kinematics/units.hpp"
#include "robot/robot_evaluator.hpp"

namespace llmt::robotics {
namespace {

// Balances truncation against rounding in central differences.
double difference_step(double value, double scale) {
  static const double relative = std::cbrt(std::numeric_limits<double>::epsilon());
  return relative * std::max(std::abs(value), scale);
}

}  // namespace

// At the values that the effect has; at any where it is linear in them.
void RobotEvaluator::by_values(PoseContext& pose, Eigen::Index row, PreparedEffect& effect,
                               Eigen::Ref<Eigen::Matrix3Xd> out) {
  given_ = effect.values;
  const auto components = std::ssize(effect.components);
  auto below = sides_.col(0).head(components);
  auto by_value = sides_.col(1).head(components);
  auto above = sides_.col(2).head(components);
  if (effect.type->linear) std::ranges::fill(effect.values, 0.0);
  for (Eigen::Index k = 0; k < out.cols(); ++k) {
    const double before = effect.values[k];
    if (effect.type->linear) {
      effect.values[k] = effect.scales[k];
      deformation_by(pose, row, effect, by_value);
      by_value /= effect.scales[k];
    } else {
      const double step = difference_step(before, effect.scales[k]);
      effect.values[k] = before - step;
      deformation_by(pose, row, effect, below);
      effect.values[k] = before + step;
      deformation_by(pose, row, effect, above);
      by_value = (above - below) / (2.0 * step);
    }
    effect.values[k] = before;
    out.col(k).setZero();
    for (Eigen::Index c = 0; c < components; ++c) {
      out.col(k) += levers_.col(place_[effect.components[c]]) * by_value(c);
    }
  }
  effect.values = given_;
}

// Of the reading by the values of an effect that changes payload or gravity for all others.
void RobotEvaluator::by_adjustments(const PoseContext& pose, Eigen::Index row, PreparedEffect& effect,
                                    bool is_candidate, Eigen::Ref<Eigen::Matrix3Xd> out) {
  out.setZero();
  if (live_.empty()) return;
  constexpr double share = 0.01;
  const auto adjusted = [&](double& value, double to) {
    value = to;
    PoseContext moved = context(row);
    adjust(moved, row, is_candidate ? &effect : nullptr);
    return moved;
  };
  for (Eigen::Index k = 0; k < out.cols(); ++k) {
    double& value = effect.values[k];
    const double given = value;
    const double step = share * effect.scales[k];
    const PoseContext above = adjusted(value, given + step);
    const PoseContext below = adjusted(value, given - step);
    value = given;
    ArmChange change{.loads = true};
    change.gravity_m_s2 = (above.gravity_m_s2 - below.gravity_m_s2) / (2.0 * step);
    change.payload_kg = (above.payload_kg - below.payload_kg) / (2.0 * step);
    change.payload_centre_mm = (above.payload_centre_mm - below.payload_centre_mm) / (2.0 * step);
    out.col(k) = reading_change(pose, change);
  }
}

// By the values of all effects of the robot.
void RobotEvaluator::set_effect_columns(PoseContext& pose, Eigen::Index row) {
  Eigen::Index count = 0;
  for (const PreparedEffect& effect : effects_) count += std::ssize(effect.values);
  by_effects_.setZero(3, count);
  Eigen::Index next = 0;
  for (PreparedEffect& effect : effects_) {
    const Eigen::Index own = std::ssize(effect.values);
    if (effect.apply) by_values(pose, row, effect, by_effects_.middleCols(next, own));
    if (effect.type->adjust) by_adjustments(pose, row, effect, false, by_effects_.middleCols(next, own));
    next += own;
  }
}

void RobotEvaluator::rigid_jacobian(Eigen::Index row, const std::vector<Eigen::Index>& parameters,
                                    Eigen::Ref<Eigen::Matrix3Xd> out) {
  q_ = poses_.joints.row(row).transpose();
  tool_ = kinematics_.motions_into(deformed_motions_, q_);
  const bool turns_only = is_orientation(row);
  for (Eigen::Index k = 0; k < out.cols(); ++k) {
    const Motion& motion = deformed_motions_[parameters[k]];
    if (turns_only) {
      out.col(k) = radians * motion.turn();
    } else {
      out.col(k) = (motion.turns ? radians : 1.0) * motion.of(tool_.position_mm);
    }
  }
  chart(row, out);
}

void RobotEvaluator::jacobian(Eigen::Index row, const std::vector<Eigen::Index>& parameters,
                              Eigen::Ref<Eigen::Matrix3Xd> out) {
  if (effects_.empty()) return rigid_jacobian(row, parameters, out);
  PoseContext pose = settle(row);
  set_levers(pose, row);
  const Eigen::Index geometric = std::ssize(deformed_motions_);
  if (std::ranges::any_of(parameters, [&](Eigen::Index k) { return k >= geometric; })) set_effect_columns(pose, row);
  for (Eigen::Index k = 0; k < out.cols(); ++k) {
    const Eigen::Index parameter = parameters[k];
    if (parameter >= geometric) {
      out.col(k) = by_effects_.col(parameter - geometric);
      continue;
    }
    const Motion& motion = deformed_motions_[parameter];
    const Motion* of_loads = bears_loads_ ? &motion : nullptr;
    if (!bears_loads_ && !live_.empty()) of_loads = &motions_[parameter];
    out.col(k) = (motion.turns ? radians : 1.0) * by_motion(pose, row, motion, of_loads);
  }
  chart(row, out);
}

void RobotEvaluator::signatures(Eigen::Index row, std::vector<PreparedEffect>& candidates,
                                Eigen::Ref<Eigen::Matrix3Xd> out) {
  PoseContext pose = settle(row);
  set_levers(pose, row);
  extend_levers(pose, row);
  Eigen::Index next = 0;
  for (PreparedEffect& candidate : candidates) {
    const Eigen::Index own = std::ssize(candidate.values);
    std::ranges::fill(candidate.values, 0.0);
    if (candidate.type->adjust) {
      by_adjustments(pose, row, candidate, true, out.middleCols(next, own));
    } else {
      by_values(pose, row, candidate, out.middleCols(next, own));
    }
    next += own;
  }
  chart(row, out);
}

}  // namespace llmt::robotics
