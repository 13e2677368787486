/// \file
/// Physical effects that rigid geometry leaves out, each one an entry of a catalogue.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/robotics/kinematics.hpp"

namespace llmt::robotics {

/// Everything an effect may look at in one pose.
struct PoseContext {
  const Chain& chain;
  const Eigen::VectorXd& q;         ///< joint values: rad, mm for prismatic joints
  const Skeleton& skeleton;         ///< of the rigid chain: loads are those of the undeformed arm
  Eigen::Vector3d gravity_m_s2;     ///< in the world frame
  double payload_kg = 0.0;          ///< column payload_kg if measured, else the chain's payload
  std::span<const double> columns;  ///< this pose's values of EffectType::columns
};

/// One unknown of an effect.
struct EffectParameter {
  std::string name;    ///< e.g. "compliance"
  std::string unit;    ///< e.g. "rad/(N m)"
  std::string key;     ///< in robot files, with the unit: "compliance_rad_per_Nm"
  double scale = 1.0;  ///< typical size, in that unit
  double lower = 0.0;  ///< plausible range on real arms, sign included
  double upper = 0.0;
};

/// What an effect is attached to.
enum class EffectPlace { joint, link, robot };

/// A kind of effect. Values of 0 mean "not there" for every parameter that is estimated.
struct EffectType {
  std::string name;                         ///< as in files, e.g. "joint_compliance"
  std::string title;                        ///< as an engineer says it
  std::string formula;                      ///< full forward formula
  std::string source;                       ///< where the formula is from
  EffectPlace place = EffectPlace::joint;   ///< joint, link or the whole robot
  std::vector<EffectParameter> parameters;  ///< in the order of Effect::values
  std::vector<std::string> columns;         ///< covariates without which it cannot be evaluated, e.g. "temp_C"
  /// Adds the effect to the deformation; `index` is the joint or link, `values` the parameters.
  std::function<void(const PoseContext&, std::size_t index, std::span<const double> values, Deformation&)> apply;
};

/// An effect of a given arm.
struct Effect {
  std::string type;            ///< EffectType::name
  std::string at;              ///< name of the joint, or of the joint that moves the link; empty for the whole robot
  std::vector<double> values;  ///< one for each parameter of the type
};

/// The catalogue, in a fixed order. Sources and formulas stand in the entries:
///
/// - `joint_compliance`: dq_j = c_j tau_j, tau_j = z_j . sum over bodies k beyond joint j and the payload of (r_k -
/// o_j) x m_k g.
/// - `link_bending`: the link as an Euler-Bernoulli cantilever of length L along the chord e from its axis to the next,
/// loaded by its
///   own weight w = m g / L per length, by the weight F of everything beyond its end b, and by the moment M of that
///   weight about b: deflection  d = (L^3/3 F' + L^4/8 w' + L^2/2 M x e) / EI, slope  th = (L^2/2 e x F + L^3/6 e x w +
///   L M') / EI (' = part normal to e); everything beyond turns by th about the displaced end. No torsion, no shear.
/// - `link_bending_no_carry_over`: each tip's deflection under its own weight and the tip force only, d = (L^3/3 F' +
/// L^4/8 w') / EI;
///   no end moment, and what lies beyond is displaced but not turned. A reduction for comparison with the paper, not
///   better physics.
const std::vector<EffectType>& effect_types();

/// Throws std::invalid_argument listing the known names if there is none of that name.
const EffectType& effect_type(std::string_view name);

/// Position in the catalogue's sense of where an effect sits: joint or link index, 0 for the whole robot. Throws
/// std::invalid_argument on an unknown type, an unknown joint, or a wrong number of values.
std::size_t effect_index(const Chain& chain, const Effect& effect);

/// "joint_compliance@joint2.compliance": the name under which an effect's parameter is calibrated.
std::string effect_parameter_name(const Effect& effect, const EffectParameter& parameter);

/// Flexibility 1/EI in 1/(N m^2) of a round bar: I = pi d^4 / 64.
double round_bar_flexibility(double diameter_mm, double youngs_modulus_gpa);

/// Mass in kg of a round bar.
double round_bar_mass(double diameter_mm, double length_mm, double density_kg_m3);

}  // namespace llmt::robotics
