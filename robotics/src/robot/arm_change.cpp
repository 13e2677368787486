#include "robot/arm_change.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "effects/effect_entries.hpp"

namespace llmt::robotics {
namespace {

// Of an axis, and of a point, that move along.
Eigen::Vector3d turned(const Motion& motion, const Eigen::Vector3d& axis) {
  if (!motion.turns) return Eigen::Vector3d::Zero();
  return motion.axis.cross(axis);
}
Eigen::Vector3d moved(const Motion& motion, const Eigen::Vector3d& point) {
  if (!motion.turns) return motion.axis;
  return motion.axis.cross(point - motion.point);
}

}  // namespace

void sum_weights(const PoseContext& pose, WeightsBeyond& weights) {
  const std::size_t joints = pose.load.size();
  weights.mass_kg.resize(joints + 1);
  weights.moment_kg_mm.resize(joints + 1);
  weights.mass_kg[joints] = pose.payload_kg;
  weights.moment_kg_mm[joints] = pose.payload_kg * pose.payload_centre_mm;
  for (std::size_t j = joints; j-- > 0;) {
    const double mass = pose.chain.joints[j].mass_kg;
    weights.mass_kg[j] = weights.mass_kg[j + 1] + mass;
    weights.moment_kg_mm[j] = weights.moment_kg_mm[j + 1] + mass * pose.skeleton.body_centre[j];
  }
}

ArmChange change_by(const Motion& motion, const PoseContext& pose) {
  ArmChange change{.motion = motion};
  change.loads = motion.turns_base;
  if (motion.turns_base) change.gravity_m_s2 = turned(motion, pose.gravity_m_s2);
  return change;
}

// The moment about origin o of masses m with centres c is (sum m c - o sum m) x g.
Load load_change(const PoseContext& pose, const WeightsBeyond& weights, const ArmChange& change, std::size_t j) {
  const Motion& motion = change.motion;
  const std::size_t first = std::max(j, motion.first_body);
  const double mass = weights.mass_kg[j];
  const Eigen::Vector3d& origin = pose.skeleton.joint_origin[j];
  Eigen::Vector3d lever_change =
      motion.turns ? motion.axis.cross(weights.moment_kg_mm[first] - weights.mass_kg[first] * motion.point).eval()
                   : Eigen::Vector3d(weights.mass_kg[first] * motion.axis);
  if (j >= motion.first_joint) lever_change -= mass * moved(motion, origin);
  Load by_change;
  if (change.loads) {
    lever_change += pose.payload_kg * change.payload_centre_mm;
    lever_change += change.payload_kg * (pose.payload_centre_mm - origin);
    const Eigen::Vector3d lever = weights.moment_kg_mm[j] - mass * origin;
    by_change.force_N = change.payload_kg * pose.gravity_m_s2 + mass * change.gravity_m_s2;
    by_change.moment_Nm = metres * lever.cross(change.gravity_m_s2);
  }
  by_change.moment_Nm += metres * lever_change.cross(pose.gravity_m_s2);
  return by_change;
}

std::vector<Input> inputs_of(const Chain& chain, const EffectType& type, std::size_t index,
                             const std::vector<std::size_t>& torques) {
  using enum Input::Kind;
  std::vector<Input> inputs;
  const auto add = [&](Input::Kind kind, std::size_t joint = 0, int columns = 1) {
    for (int column = 0; column < columns; ++column) inputs.push_back({kind, joint, column});
  };
  for (const std::size_t j : torques) add(torque, j);
  if (type.senses != Senses::arm) return inputs;
  const std::size_t joints = chain.joints.size();
  add(gravity);
  if (type.place == EffectPlace::joint) {
    add(axis, index);
    add(frame, index, 3);
    for (std::size_t j = index; j < joints; ++j) add(body, j, 3);
  } else if (type.place == EffectPlace::link) {
    for (const Input::Kind kind : {origin, axis, end, centre}) add(kind, index);
    for (const Input::Kind kind : {payload_centre, payload}) add(kind);
    if (index + 1 == joints) return inputs;
    for (const Input::Kind kind : {origin, force, moment}) add(kind, index + 1);
  } else {
    add(origin);
    add(moment);
    add(tool);
    add(base, 0, 3);
  }
  return inputs;
}

void Place::shift(int k, double by) const {
  if (axis.isZero(0.0)) {
    numbers[k] += by;
  } else {
    Eigen::Map<Eigen::Vector3d>(numbers) += by * axis;
  }
}

Place place_of(const Input& input, PoseContext& pose, Skeleton& skeleton, std::vector<Load>& loads) {
  constexpr double share = 1e-6;
  constexpr double length_mm = 0.01;
  const std::size_t j = input.joint;
  const auto vector = [](Eigen::Vector3d& v, double step) { return Place{v.data(), 3, step, Eigen::Vector3d::Zero()}; };
  const auto column = [&](Eigen::Matrix3d& m) {
    return Place{m.data() + 3 * input.column, 3, share, Eigen::Vector3d::Zero()};
  };
  const auto size = [](const Eigen::Vector3d& v) { return share * std::max(1.0, v.norm()); };
  switch (input.kind) {
    case Input::Kind::torque: {
      Eigen::Vector3d& load = is_prismatic(pose.chain, j) ? loads[j].force_N : loads[j].moment_Nm;
      return {load.data(), 1, size(load), skeleton.joint_axis[j]};
    }
    case Input::Kind::origin:
      return vector(skeleton.joint_origin[j], length_mm);
    case Input::Kind::axis:
      return vector(skeleton.joint_axis[j], share);
    case Input::Kind::frame:
      return column(skeleton.joint_frame[j]);
    case Input::Kind::end:
      return vector(skeleton.link_end[j], length_mm);
    case Input::Kind::centre:
      return vector(skeleton.body_centre[j], length_mm);
    case Input::Kind::body:
      return column(skeleton.body_rotation[j]);
    case Input::Kind::force:
      return vector(loads[j].force_N, size(loads[j].force_N));
    case Input::Kind::moment:
      return vector(loads[j].moment_Nm, size(loads[j].moment_Nm));
    case Input::Kind::gravity:
      return vector(pose.gravity_m_s2, size(pose.gravity_m_s2));
    case Input::Kind::base:
      return column(skeleton.base_rotation);
    case Input::Kind::tool:
      return vector(skeleton.tool.position_mm, length_mm);
    case Input::Kind::payload_centre:
      return vector(pose.payload_centre_mm, length_mm);
    case Input::Kind::payload:
      break;
  }
  return {&pose.payload_kg, 1, share, Eigen::Vector3d::Zero()};
}

Eigen::Vector3d input_change(const PoseContext& pose, const WeightsBeyond& weights, const ArmChange& change,
                             const Input& input) {
  const Motion& motion = change.motion;
  const std::size_t j = input.joint;
  const Skeleton& arm = pose.skeleton;
  const bool joint_moves = j >= motion.first_joint;
  const bool body_moves = j >= motion.first_body;
  const Eigen::Vector3d nothing = Eigen::Vector3d::Zero();
  switch (input.kind) {
    case Input::Kind::torque: {
      const bool slides = is_prismatic(pose.chain, j);
      const Load by_change = load_change(pose, weights, change, j);
      double sum = arm.joint_axis[j].dot(slides ? by_change.force_N : by_change.moment_Nm);
      if (joint_moves) {
        sum += turned(motion, arm.joint_axis[j]).dot(slides ? pose.load[j].force_N : pose.load[j].moment_Nm);
      }
      return {sum, 0.0, 0.0};
    }
    case Input::Kind::origin:
      return joint_moves ? moved(motion, arm.joint_origin[j]) : nothing;
    case Input::Kind::axis:
      return joint_moves ? turned(motion, arm.joint_axis[j]) : nothing;
    case Input::Kind::frame:
      return joint_moves ? turned(motion, arm.joint_frame[j].col(input.column)) : nothing;
    case Input::Kind::end:
      return j + 1 >= motion.first_joint ? moved(motion, arm.link_end[j]) : nothing;
    case Input::Kind::centre:
      return body_moves ? moved(motion, arm.body_centre[j]) : nothing;
    case Input::Kind::body:
      return body_moves ? turned(motion, arm.body_rotation[j].col(input.column)) : nothing;
    case Input::Kind::force:
      // Moved weights weigh what they did.
      return change.loads ? load_change(pose, weights, change, j).force_N : nothing;
    case Input::Kind::moment:
      return load_change(pose, weights, change, j).moment_Nm;
    case Input::Kind::gravity:
      return change.gravity_m_s2;
    case Input::Kind::base:
      return motion.turns_base ? turned(motion, arm.base_rotation.col(input.column)) : nothing;
    case Input::Kind::tool:
      return moved(motion, arm.tool.position_mm);
    case Input::Kind::payload_centre:
      return moved(motion, pose.payload_centre_mm) + change.payload_centre_mm;
    case Input::Kind::payload:
      break;
  }
  return {change.payload_kg, 0.0, 0.0};
}

}  // namespace llmt::robotics
