#include "robot/robot_evaluator.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {
namespace {

// Balances truncation against rounding in central differences.
double difference_step(double value, double scale) {
  static const double relative = std::cbrt(std::numeric_limits<double>::epsilon());
  return relative * std::max(std::abs(value), scale);
}

}  // namespace

const Eigen::VectorXd* find_column(const Poses& poses, const std::string& names) {
  for (const std::string& name : alternatives(names)) {
    const auto found = poses.covariates.find(name);
    if (found != poses.covariates.end()) return &found->second;
  }
  return nullptr;
}

PreparedEffect prepare(const Chain& chain, const Effect& effect, const Poses& poses) {
  PreparedEffect prepared{.type = &effect_type(effect.type),
                          .index = effect_index(chain, effect),
                          .apply = {},
                          .values = effect.values,
                          .constants = effect.constants,
                          .scales = {},
                          .columns = {}};
  prepared.apply = effect.type == "formula" ? compile_formula(chain, effect) : prepared.type->apply;
  for (const EffectParameter& parameter : effect_parameters(chain, effect)) prepared.scales.push_back(parameter.scale);
  for (const std::string& names : effect_columns(chain, effect)) {
    prepared.columns.push_back(find_column(poses, names));
    if (prepared.columns.back() == nullptr) {
      throw std::invalid_argument(fmt::format(
          "llmt::robotics::positions: effect {} needs the column {}, which is missing", effect_label(effect), names));
    }
  }
  return prepared;
}

RobotEvaluator::RobotEvaluator(const Robot& robot, const Poses& poses)
    : robot_(robot),
      poses_(poses),
      kinematics_(robot.chain),
      loads_(robot.chain.joints.size()),
      deformation_(robot.chain.joints.size()),
      trial_(robot.chain.joints.size()) {
  if (poses.joints.cols() != std::ssize(robot.chain.joints)) {
    throw std::invalid_argument(fmt::format("llmt::robotics::positions: the poses have {} joints, robot {} has {}",
                                            poses.joints.cols(), robot.chain.name, robot.chain.joints.size()));
  }
  payload_ = find_column(poses, "payload_kg");
  for (const Effect& effect : robot.effects) effects_.push_back(prepare(robot.chain, effect, poses));
  bears_loads_ = std::ranges::any_of(effects_, [](const PreparedEffect& effect) { return effect.type->elastic; });
  levers_.joint.resize(robot.chain.joints.size());
  levers_.link.resize(robot.chain.joints.size());
}

PoseContext RobotEvaluator::context(Eigen::Index row) {
  return {.chain = robot_.chain,
          .q = q_,
          .skeleton = rigid_,
          .gravity_m_s2 = rigid_.base_rotation * robot_.chain.gravity_m_s2,
          .payload_kg = payload_ != nullptr ? (*payload_)(row) : robot_.chain.payload.mass_kg,
          .payload_centre_mm = rigid_.payload_centre,
          .load = loads_,
          .columns = {}};
}

// From the flange inwards: what lies beyond a joint is what lies beyond the next one and the link between.
void RobotEvaluator::sum_loads(const PoseContext& pose) {
  Eigen::Vector3d force = pose.payload_kg * pose.gravity_m_s2;
  Eigen::Vector3d point = pose.payload_centre_mm;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (std::size_t j = loads_.size(); j-- > 0;) {
    const Eigen::Vector3d& origin = rigid_.joint_origin[j];
    const Eigen::Vector3d weight = robot_.chain.joints[j].mass_kg * pose.gravity_m_s2;
    moment += metres * ((point - origin).cross(force) + (rigid_.body_centre[j] - origin).cross(weight));
    force += weight;
    point = origin;
    loads_[j] = {force, moment};
  }
}

void RobotEvaluator::adjust(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect) {
  columns_.clear();
  for (const Eigen::VectorXd* column : effect.columns) columns_.push_back((*column)(row));
  pose.columns = columns_;
  effect.type->adjust(pose, effect.values);
}

void RobotEvaluator::apply(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect, Deformation& sum) {
  // No instrument sees a socket or a plane.
  const Observation* seen = observation(row);
  if (effect.type->of_measuring && seen != nullptr && is_touched(seen->base)) return;
  columns_.clear();
  for (const Eigen::VectorXd* column : effect.columns) columns_.push_back((*column)(row));
  pose.columns = columns_;
  effect.apply(pose, effect.index, effect.values, effect.constants, sum);
}

// Of the robot's effects, and of one more that adjusts what they are evaluated with.
void RobotEvaluator::deform(PoseContext& pose, Eigen::Index row, const PreparedEffect* extra, Deformation& sum) {
  for (const PreparedEffect& effect : effects_) {
    if (effect.type->adjust) adjust(pose, row, effect);
  }
  if (extra != nullptr) adjust(pose, row, *extra);
  sum_loads(pose);
  sum.clear();
  for (const PreparedEffect& effect : effects_) {
    if (effect.apply) apply(pose, row, effect, sum);
  }
}

// Equilibrium: loads are those of the deformed arm, which the first pass finds to first order. Deflections are some
// thousandths of the levers, so every pass gains three digits.
Pose RobotEvaluator::pose(Eigen::Index row) {
  constexpr int passes = 3;
  q_ = poses_.joints.row(row).transpose();
  if (effects_.empty()) return kinematics_.forward(q_);
  kinematics_.skeleton_into(rigid_, q_);
  for (int pass = 0; pass < (bears_loads_ ? passes : 1); ++pass) {
    if (pass > 0) kinematics_.skeleton_into(rigid_, q_, &deformation_);
    PoseContext around = context(row);
    deform(around, row, nullptr, deformation_);
  }
  return kinematics_.forward(q_, &deformation_);
}

Eigen::VectorXd RobotEvaluator::gravity_loads(Eigen::Index row) {
  q_ = poses_.joints.row(row).transpose();
  kinematics_.skeleton_into(rigid_, q_);
  PoseContext pose = context(row);
  deform(pose, row, nullptr, deformation_);
  Eigen::VectorXd loads(q_.size());
  for (std::size_t j = 0; j < loads_.size(); ++j) {
    const bool slides = robot_.chain.joints[j].type == JointType::prismatic;
    loads(j) = rigid_.joint_axis[j].dot(slides ? loads_[j].force_N : loads_[j].moment_Nm);
  }
  return loads;
}

// From motions of the tool to changes of what is read.
void RobotEvaluator::chart(Eigen::Index row, Eigen::Ref<Eigen::Matrix3Xd> derivatives) const {
  const Observation* seen = observation(row);
  if (seen == nullptr || seen->reading == Reading::position) return;
  derivatives = reading_derivative(deformed_.tool, *seen) * derivatives;
}

void RobotEvaluator::set_levers(Eigen::Index row) {
  const Eigen::Vector3d& tool = deformed_.tool.position_mm;
  levers_.turns_only = is_orientation(row);
  levers_.base = tool - deformed_.joint_origin[0];
  for (std::size_t j = 0; j < levers_.joint.size(); ++j) {
    const Eigen::Vector3d& axis = deformed_.joint_axis[j];
    const bool turns = robot_.chain.joints[j].type == JointType::revolute;
    if (levers_.turns_only) {
      levers_.joint[j] = turns ? axis : Eigen::Vector3d::Zero();
      continue;
    }
    levers_.joint[j] = turns ? axis.cross(tool - deformed_.joint_origin[j]) : axis;
    levers_.link[j] = tool - deformed_.link_end[j];
  }
}

Eigen::Vector3d RobotEvaluator::displacement(const Deformation& change) const {
  if (levers_.turns_only) {
    Eigen::Vector3d turn = change.base.rotation_rad;
    for (std::size_t j = 0; j < levers_.joint.size(); ++j) {
      turn += change.joint(j) * levers_.joint[j] + change.link[j].rotation_rad;
    }
    return turn;
  }
  Eigen::Vector3d sum = change.world_mm + change.base.translation_mm + change.base.rotation_rad.cross(levers_.base);
  for (std::size_t j = 0; j < levers_.joint.size(); ++j) {
    sum += change.joint(j) * levers_.joint[j];
    sum += change.link[j].translation_mm + change.link[j].rotation_rad.cross(levers_.link[j]);
  }
  return sum;
}

Eigen::Vector3d RobotEvaluator::moved_by(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect) {
  trial_.clear();
  apply(pose, row, effect, trial_);
  return displacement(trial_);
}

// Of an effect that is applied on top of what is there, at its values.
void RobotEvaluator::derivatives(PoseContext& pose, Eigen::Index row, PreparedEffect& effect,
                                 Eigen::Ref<Eigen::Matrix3Xd> out) {
  if (effect.type->linear) {
    for (Eigen::Index k = 0; k < out.cols(); ++k) {
      effect.values.assign(effect.values.size(), 0.0);
      effect.values[k] = effect.scales[k];
      out.col(k) = moved_by(pose, row, effect) / effect.scales[k];
    }
    return;
  }
  for (Eigen::Index k = 0; k < out.cols(); ++k) {
    double& value = effect.values[k];
    const double before = value;
    const double step = difference_step(before, effect.scales[k]);
    value = before + step;
    const Eigen::Vector3d above = moved_by(pose, row, effect);
    value = before - step;
    out.col(k) = (above - moved_by(pose, row, effect)) / (2.0 * step);
    value = before;
  }
}

// Of an effect that changes what all the others are evaluated with. Leaves deformation_ as it is.
void RobotEvaluator::whole_derivatives(Eigen::Index row, PreparedEffect& effect, bool is_candidate,
                                       Eigen::Ref<Eigen::Matrix3Xd> out) {
  const auto moved = [&](double& value, double to) {
    value = to;
    PoseContext pose = context(row);
    deform(pose, row, is_candidate ? &effect : nullptr, trial_);
    return displacement(trial_);
  };
  for (Eigen::Index k = 0; k < out.cols(); ++k) {
    double& value = effect.values[k];
    const double before = value;
    const double step = effect.scales[k];
    const Eigen::Vector3d above = moved(value, before + step);
    out.col(k) = (above - moved(value, before - step)) / (2.0 * step);
    value = before;
  }
}

Eigen::Matrix3Xd RobotEvaluator::jacobian(Eigen::Index row) {
  q_ = poses_.joints.row(row).transpose();
  if (effects_.empty()) {
    Eigen::Matrix3Xd result =
        is_orientation(row) ? kinematics_.rotation_jacobian(q_) : kinematics_.position_jacobian(q_);
    if (observation(row) != nullptr) deformed_.tool = kinematics_.forward(q_);
    chart(row, result);
    return result;
  }
  kinematics_.skeleton_into(rigid_, q_);
  PoseContext pose = context(row);
  deform(pose, row, nullptr, deformation_);
  kinematics_.skeleton_into(deformed_, q_, &deformation_);
  set_levers(row);
  Eigen::Index count = 0;
  for (const PreparedEffect& effect : effects_) count += std::ssize(effect.values);
  const Eigen::Matrix3Xd geometry = is_orientation(row) ? kinematics_.rotation_jacobian(q_, &deformation_)
                                                        : kinematics_.position_jacobian(q_, &deformation_);
  Eigen::Matrix3Xd result(3, geometry.cols() + count);
  result.leftCols(geometry.cols()) = geometry;
  Eigen::Index next = geometry.cols();
  for (std::size_t e = 0; e < effects_.size(); ++e) {
    PreparedEffect& effect = effects_[e];
    const Eigen::Index own = std::ssize(effect.values);
    if (effect.type->adjust) {
      whole_derivatives(row, effect, false, result.middleCols(next, own));
      sum_loads(pose);  // the loads are those of the trial
    } else {
      derivatives(pose, row, effect, result.middleCols(next, own));
    }
    effect.values = robot_.effects[e].values;
    next += own;
  }
  chart(row, result);
  return result;
}

Eigen::Matrix3Xd RobotEvaluator::joint_motion(Eigen::Index row) {
  q_ = poses_.joints.row(row).transpose();
  const Eigen::Matrix<double, 6, Eigen::Dynamic> motion = kinematics_.joint_jacobian(q_);
  Eigen::Matrix3Xd result = is_orientation(row) ? motion.bottomRows(3) : motion.topRows(3);
  if (observation(row) != nullptr) deformed_.tool = kinematics_.forward(q_);
  chart(row, result);
  return result;
}

void RobotEvaluator::signatures(Eigen::Index row, std::vector<PreparedEffect>& candidates,
                                Eigen::Ref<Eigen::Matrix3Xd> out) {
  q_ = poses_.joints.row(row).transpose();
  kinematics_.skeleton_into(rigid_, q_);
  PoseContext pose = context(row);
  deform(pose, row, nullptr, deformation_);
  kinematics_.skeleton_into(deformed_, q_, &deformation_);
  set_levers(row);
  Eigen::Index next = 0;
  for (PreparedEffect& candidate : candidates) {
    const Eigen::Index own = std::ssize(candidate.values);
    candidate.values.assign(candidate.values.size(), 0.0);
    if (candidate.type->adjust) {
      whole_derivatives(row, candidate, true, out.middleCols(next, own));
      sum_loads(pose);  // the loads are those of the trial
    } else {
      derivatives(pose, row, candidate, out.middleCols(next, own));
    }
    next += own;
  }
  chart(row, out);
}

}  // namespace llmt::robotics
