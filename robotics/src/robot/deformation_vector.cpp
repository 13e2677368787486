#include "robot/deformation_vector.hpp"

#include <algorithm>

namespace llmt::robotics {
namespace {

bool is_zero(const Deformation::Twist& twist) {
  return twist.translation_mm.isZero(0.0) && twist.rotation_rad.isZero(0.0);
}

}  // namespace

Eigen::Index component_count(Eigen::Index joints) { return per_twist * (joints + 1) + joints + 3; }

const Deformation::Twist& twist_of(const Deformation& deformation, Eigen::Index twist) {
  return twist == 0 ? deformation.base : deformation.link[twist - 1];
}

double& component_of(Deformation& deformation, Eigen::Index component) {
  const Eigen::Index joints = deformation.joint.size();
  const Eigen::Index after_twists = component - per_twist * (joints + 1);
  if (after_twists >= joints) return deformation.world_mm(after_twists - joints);
  if (after_twists >= 0) return deformation.joint(after_twists);
  const Eigen::Index number = component / per_twist;
  Deformation::Twist& twist = number == 0 ? deformation.base : deformation.link[number - 1];
  const Eigen::Index axis = component % per_twist;
  return axis < 3 ? twist.translation_mm(axis) : twist.rotation_rad(axis - 3);
}

bool has_twists(const Deformation& deformation) {
  return !is_zero(deformation.base) || !std::ranges::all_of(deformation.link, is_zero);
}

std::vector<Eigen::Index> components_of(const EffectType& type, Eigen::Index index, Eigen::Index joints) {
  std::vector<Eigen::Index> components;
  const auto add = [&](Eigen::Index first, Eigen::Index count) {
    for (Eigen::Index k = 0; k < count; ++k) components.push_back(first + k);
  };
  const Eigen::Index first_joint = per_twist * (joints + 1);
  const bool is_formula = type.name == "formula";
  if (type.place == EffectPlace::link) add(per_twist * (index + 1), per_twist);
  if (type.place == EffectPlace::robot) add(0, per_twist);
  // An axis that wobbles turns all from the joint on.
  if (type.place == EffectPlace::joint && type.senses == Senses::arm) add(per_twist * index, per_twist);
  if (type.place == EffectPlace::joint) add(first_joint + index, 1);
  if (type.place == EffectPlace::robot || is_formula) add(first_joint + joints, 3);
  return components;
}

}  // namespace llmt::robotics
