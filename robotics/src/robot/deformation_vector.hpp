// A deformation as a vector of components: six of each twist (translation in mm, rotation vector in rad; the base's
// first, then the links'), then one of each joint, then three of world_mm.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/robotics/effect_type.hpp"

namespace llmt::robotics {

inline constexpr Eigen::Index per_twist = 6;

/// Number of components of the deformation of an arm with this number of joints.
Eigen::Index component_count(Eigen::Index joints);

double& component_of(Deformation& deformation, Eigen::Index component);

/// The twist of the base (0) or of link i (i + 1).
const Deformation::Twist& twist_of(const Deformation& deformation, Eigen::Index twist);

/// True if base or links are moved.
bool has_twists(const Deformation& deformation);

/// All that an effect of that type at that joint or link may change, ascending. Twists count whole, because a turn of
/// the arm exchanges their components.
std::vector<Eigen::Index> components_of(const EffectType& type, Eigen::Index index, Eigen::Index joints);

}  // namespace llmt::robotics
