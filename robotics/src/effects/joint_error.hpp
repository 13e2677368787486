// Parts that the effects of a joint's value share.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "effects/effect_entries.hpp"

namespace llmt::robotics {

/// EffectType::apply of an effect that is an error of the joint value: rad, mm for a prismatic joint.
template <typename Error>
auto joint_error(Error error) {
  return [error](const PoseContext& pose, std::size_t j, Values values, Values constants, Deformation& deformation) {
    deformation.joint(j) += error(pose, j, values, constants);
  };
}

inline double sign(double value) { return value > 0.0 ? 1.0 : value < 0.0 ? -1.0 : 0.0; }

inline double harmonic(double angle, Values values) {
  return values[0] * std::cos(angle) + values[1] * std::sin(angle);
}

/// Unit in which a compliance of a joint counts: a prismatic joint yields in mm, its compliance is in m/N.
inline double compliance_unit(bool is_prismatic) { return is_prismatic ? 1.0 / metres : 1.0; }

std::string must_be_positive(const char* name, double value);

std::vector<EffectParameter> cosine_and_sine();

/// An angle, or a length at a prismatic joint.
EffectParameter angle(const std::string& name);

/// rad/(N m), or m/N at a prismatic joint.
EffectParameter joint_compliance_parameter();

/// The largest torque of gravity about the joint over all poses, or 0 where it is rounding: about an upright axis.
double largest_torque(const TrialContext& context, std::size_t joint);

/// Constants at some shares of the largest torque, to two digits, so that labels are the same in every round of a
/// search. None where gravity has no torque.
std::vector<std::vector<double>> shares_of_largest_torque(const TrialContext& context, std::size_t joint,
                                                          const std::vector<double>& shares);

/// A number as C reads it back exactly.
std::string c_number(double value);

/// a cos(angle) + b sin(angle) in C.
std::string c_harmonic(Values values, const std::string& angle);

/// "@_sign(x)" in C.
extern const char* const c_sign;

}  // namespace llmt::robotics
