#include "robot/robot_evaluator.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>
#include <stdexcept>

#include "effects/effect_entries.hpp"
#include "llmt/robotics/effects.hpp"
#include "robot/deformation_vector.hpp"

namespace llmt::robotics {
namespace {

// Joints whose torques an effect depends on.
std::vector<std::size_t> torques_of(const Effect& effect, const PreparedEffect& prepared) {
  if (effect.type == "formula") return formula_torques(effect.formula.terms);
  if (prepared.type->senses != Senses::torques) return {};
  return {prepared.index};
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
                          .columns = {},
                          .inputs = {},
                          .components = {}};
  prepared.components = components_of(*prepared.type, static_cast<Eigen::Index>(prepared.index), poses.joints.cols());
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

RobotEvaluator::RobotEvaluator(const Setting& setting) : RobotEvaluator(setting.robot, setting.poses) {
  is_touched_ = setting.is_touched;
  radius_mm_ = setting.radius_mm;
}

RobotEvaluator::RobotEvaluator(const Robot& robot, const Poses& poses)
    : robot_(robot),
      poses_(poses),
      kinematics_(robot.chain),
      before_(robot.chain.joints.size()),
      deformation_(robot.chain.joints.size()),
      loads_(robot.chain.joints.size()),
      trial_(robot.chain.joints.size()) {
  if (poses.joints.cols() != std::ssize(robot.chain.joints)) {
    throw std::invalid_argument(fmt::format("llmt::robotics::positions: the poses have {} joints, robot {} has {}",
                                            poses.joints.cols(), robot.chain.name, robot.chain.joints.size()));
  }
  payload_ = find_column(poses, "payload_kg");
  for (const Effect& effect : robot.effects) {
    effects_.push_back(prepare(robot.chain, effect, poses));
    PreparedEffect& prepared = effects_.back();
    for (const Input& input : inputs_of(robot.chain, *prepared.type, prepared.index, torques_of(effect, prepared))) {
      const auto known = std::ranges::find(inputs_, input);
      prepared.inputs.push_back(known - inputs_.begin());
      if (known == inputs_.end()) inputs_.push_back(input);
    }
  }
  std::set<Eigen::Index> components;
  for (const PreparedEffect& effect : effects_) components.insert(effect.components.begin(), effect.components.end());
  own_components_.assign(components.begin(), components.end());
  bears_loads_ = std::ranges::any_of(effects_, [](const PreparedEffect& effect) { return effect.type->elastic; });
  for (Eigen::Index k = 0; k < component_count(poses.joints.cols()); ++k) {
    trial_components_.push_back(&component_of(trial_, k));
  }
  sides_.resize(std::ssize(trial_components_), 3);
}

PoseContext RobotEvaluator::context(Eigen::Index row) {
  return {.chain = robot_.chain,
          .q = q_,
          .skeleton = arm_,
          .gravity_m_s2 = arm_.base_rotation * robot_.chain.gravity_m_s2,
          .payload_kg = payload_ != nullptr ? (*payload_)(row) : robot_.chain.payload.mass_kg,
          .payload_centre_mm = arm_.payload_centre,
          .load = loads_,
          .columns = {}};
}

// From the flange inwards: what lies beyond a joint is what lies beyond the next one and the link between.
void RobotEvaluator::sum_loads(const PoseContext& pose) {
  Eigen::Vector3d force = pose.payload_kg * pose.gravity_m_s2;
  Eigen::Vector3d point = pose.payload_centre_mm;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (std::size_t j = loads_.size(); j-- > 0;) {
    const Eigen::Vector3d& origin = arm_.joint_origin[j];
    const Eigen::Vector3d weight = robot_.chain.joints[j].mass_kg * pose.gravity_m_s2;
    moment += metres * ((point - origin).cross(force) + (arm_.body_centre[j] - origin).cross(weight));
    force += weight;
    point = origin;
    loads_[j] = {force, moment};
  }
}

// By the robot's effects that adjust payload or gravity, and by one more.
void RobotEvaluator::adjust(PoseContext& pose, Eigen::Index row, const PreparedEffect* extra) {
  const auto by = [&](const PreparedEffect& effect) {
    columns_.clear();
    for (const Eigen::VectorXd* column : effect.columns) columns_.push_back((*column)(row));
    pose.columns = columns_;
    effect.type->adjust(pose, effect.values);
  };
  for (const PreparedEffect& effect : effects_) {
    if (effect.type->adjust) by(effect);
  }
  if (extra != nullptr) by(*extra);
}

void RobotEvaluator::apply(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect, Deformation& sum) {
  if (effect.type->of_measuring && is_touched_) return;  // no instrument sees it
  columns_.clear();
  for (const Eigen::VectorXd* column : effect.columns) columns_.push_back((*column)(row));
  pose.columns = columns_;
  effect.apply(pose, effect.index, effect.values, effect.constants, sum);
}

// By the effects, of the arm as it stands.
PoseContext RobotEvaluator::deform(Eigen::Index row) {
  PoseContext pose = context(row);
  adjust(pose, row);
  sum_loads(pose);
  deformation_.clear();
  for (const PreparedEffect& effect : effects_) {
    if (effect.apply) apply(pose, row, effect, deformation_);
  }
  return pose;
}

// Equilibrium: loads are those of the deformed arm, which the first pass finds to first order. Deflections are some
// thousandths of the levers, so every pass gains three digits.
PoseContext RobotEvaluator::settle(Eigen::Index row) {
  constexpr int passes = 3;
  q_ = poses_.joints.row(row).transpose();
  kinematics_.skeleton_into(arm_, q_);
  for (int pass = 1; bears_loads_ && pass < passes; ++pass) {
    deform(row);
    before_ = deformation_;
    kinematics_.skeleton_into(arm_, q_, &before_);
  }
  return deform(row);
}

Pose RobotEvaluator::pose(Eigen::Index row) {
  if (effects_.empty()) return kinematics_.forward(poses_.joints.row(row).transpose());
  settle(row);
  return kinematics_.forward(q_, &deformation_);
}

Eigen::VectorXd RobotEvaluator::gravity_loads(Eigen::Index row) {
  q_ = poses_.joints.row(row).transpose();
  kinematics_.skeleton_into(arm_, q_);
  deform(row);
  Eigen::VectorXd loads(q_.size());
  for (std::size_t j = 0; j < loads_.size(); ++j) {
    const bool slides = robot_.chain.joints[j].type == JointType::prismatic;
    loads(j) = arm_.joint_axis[j].dot(slides ? loads_[j].force_N : loads_[j].moment_Nm);
  }
  return loads;
}

// From motions of the tool to changes of what is read.
void RobotEvaluator::chart(Eigen::Index row, Eigen::Ref<Eigen::Matrix3Xd> derivatives) const {
  const Observation* seen = observation(row);
  if (seen == nullptr || seen->reading == Reading::position) return;
  derivatives = reading_derivative(tool_, *seen) * derivatives;
}

Eigen::Matrix3Xd RobotEvaluator::joint_motion(Eigen::Index row) {
  q_ = poses_.joints.row(row).transpose();
  const Eigen::Matrix<double, 6, Eigen::Dynamic> motion = kinematics_.joint_jacobian(q_);
  Eigen::Matrix3Xd result = is_orientation(row) ? motion.bottomRows(3) : motion.topRows(3);
  if (observation(row) != nullptr) tool_ = kinematics_.forward(q_);
  chart(row, result);
  return result;
}

}  // namespace llmt::robotics
