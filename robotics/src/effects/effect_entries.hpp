// The parts of the catalogue, and what their formulas share.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <string>
#include <vector>

#include "llmt/robotics/effect_type.hpp"

namespace llmt::robotics {

inline constexpr double metres = 1e-3;  // m per mm

using Values = std::span<const double>;

/// Rows of the catalogue without sizes, titles and notes, which come from the table robotics/catalogue.yaml.
std::vector<EffectType> compliance_effects();
std::vector<EffectType> elastic_effects();
std::vector<EffectType> drive_effects();
std::vector<EffectType> periodic_effects();
std::vector<EffectType> friction_effects();
std::vector<EffectType> whole_arm_effects();
std::vector<EffectType> instrument_effects();
EffectType formula_effect();

/// All rows of the library, in the order of effect_types().
std::vector<EffectType> library_effects();

/// The table robotics/catalogue.yaml as text.
extern const char* const default_catalogue_yaml;

/// The rows and the table of sizes that effect_types() consists of.
std::vector<EffectType> effect_table();
std::string size_table();

/// EffectTrial::constants of types whose constants are not known beforehand.
inline std::vector<std::vector<double>> no_constants(const TrialContext&, std::size_t) { return {}; }

/// A table of errors of a joint: values at `first`, `first + step`, ... in rad (mm).
Effect joint_map_effect(const Joint& joint, double first, double step, std::vector<double> values);

using ApplyFunction = decltype(EffectType::apply);

/// The effect's expressions as a function that keeps what it needs. Throws ExpressionError.
ApplyFunction compile_formula(const Chain& chain, const Effect& effect);

/// All names of variables in an expression, ascending. Throws ExpressionError.
std::vector<std::string> names_in_formula(const std::string& text);

/// Names in the expressions that are neither joint values nor torques.
std::vector<std::string> formula_columns(const std::vector<FormulaTerm>& terms);

/// The joints, counted from 0, whose torques the expressions name, ascending.
std::vector<std::size_t> formula_torques(const std::vector<FormulaTerm>& terms);

/// The typical size of what a term is multiplied by: as stated, or else that of what it acts on.
double scale_of(const FormulaTerm& term, bool is_prismatic);

/// The reason for which an effect of type "formula" cannot be evaluated, or nothing.
std::string formula_refusal(const Chain& chain, const Effect& effect);

/// The reason for which one of its terms cannot be evaluated, or nothing. Only the place of `effect` counts.
std::string term_refusal(const Chain& chain, const Effect& effect, const FormulaTerm& term);

/// "{}" replaced by the number of the joint.
std::string with_joint_number(std::string pattern, std::size_t joint);

/// True if the effect is one of a whole robot: its type is, or it is a formula at no joint.
bool is_of_whole_robot(const EffectType& type, const Effect& effect);

inline bool is_prismatic(const Chain& chain, std::size_t joint) {
  return chain.joints[joint].type == JointType::prismatic;
}

/// Gravity's torque about a joint in N m, or its force along a prismatic joint in N.
inline double gravity_load(const PoseContext& pose, std::size_t joint) {
  const Load& load = pose.load[joint];
  return pose.skeleton.joint_axis[joint].dot(is_prismatic(pose.chain, joint) ? load.force_N : load.moment_Nm);
}

/// Everything from joint `joint` on, its axis included, moves by a twist about the joint's origin.
inline Deformation::Twist& twist_before(Deformation& deformation, std::size_t joint) {
  return joint == 0 ? deformation.base : deformation.link[joint - 1];
}

}  // namespace llmt::robotics
