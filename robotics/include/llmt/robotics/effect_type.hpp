/// \file
/// What an effect and a kind of effect consist of.
///
///     const EffectType& type = effect_type("joint_compliance");
///     const std::string unit = type.parameters[0].unit;  // "rad/(N m)"
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/robotics/kinematics.hpp"

namespace llmt::robotics {

/// Weight of a part of the arm, in the world frame.
struct Load {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment_Nm = Eigen::Vector3d::Zero();
};

/// Everything an effect may look at in one pose.
struct PoseContext {
  const Chain& chain;
  const Eigen::VectorXd& q;      ///< joint values: rad, mm for prismatic joints
  const Skeleton& skeleton;      ///< of the chain in equilibrium, where the loads act
  Eigen::Vector3d gravity_m_s2;  ///< in the world frame
  double payload_kg = 0.0;       ///< column payload_kg if measured, else the chain's payload
  Eigen::Vector3d payload_centre_mm = Eigen::Vector3d::Zero();  ///< in the world frame
  std::span<const Load> load;  ///< J: weight of link j, everything beyond it and the payload; about joint j's origin
  std::span<const double> columns;  ///< this pose's values of EffectType::columns
};

/// One unknown of an effect, or a list of unknowns of one kind.
struct EffectParameter {
  std::string name;       ///< e.g. "compliance"
  std::string unit = {};  ///< e.g. "rad/(N m)"
  std::string key = {};   ///< in robot files, with the unit: "compliance_rad_per_Nm"
  double scale = 1.0;     ///< typical size, in that unit
  double lower = 0.0;     ///< plausible range on real arms, sign included
  double upper = 0.0;
  bool list = false;                ///< stands for all values of the effect; then it is the only parameter of its type
  bool each_body = false;           ///< a list of three values, along x, y and z, for each body from the joint's on
  std::string prismatic_unit = {};  ///< at a prismatic joint, where it differs; sizes in mm are 1000 times larger
  std::string prismatic_key = {};
};

/// A number of an effect that is given and that calibration does not change: harmonic order, reference temperature,
/// knots.
struct EffectConstant {
  std::string name;
  std::string key;                 ///< in robot files, with the unit
  double usual = 0.0;              ///< what make_effect() gives it
  std::string prismatic_key = {};  ///< at a prismatic joint, where it differs
};

/// One term of a user's own effect: an expression that is multiplied by one value of the effect.
struct FormulaTerm {
  std::string acts_on;    ///< "joint": error of its value in rad (mm if prismatic); "x", "y", "z": world position in mm
  std::string text;       ///< of q1 ... (rad, mm if prismatic), tau1 ... (gravity, N m, N) and covariates
  std::string name = {};  ///< of its value, or empty: "coefficient_1"
  std::string unit = {};  ///< of its value, or empty: that of what it acts on
  double scale = 0.0;     ///< typical size of its value, or 0: 1e-4 rad, 0.1 mm, as if the expression were of order 1
};

/// What a user's own effect computes: sum of values times terms.
struct Formula {
  std::string name;
  std::vector<FormulaTerm> terms;
};

/// Properties of an arm in a pose that `apply` depends on, besides joint values and columns: derivatives follow them.
enum class Senses {
  nothing,
  torques,  ///< gravity's torque about its joint (force along it), or about the joints that a formula names
  arm       ///< points, axes, loads, gravity
};

/// What an effect is attached to.
enum class EffectPlace { joint, link, robot };

/// The quantity that the size of an effect follows. Discovery decides by it which effects may be mistaken for parts of
/// one another, and how it looks for a constant.
enum class Nature {
  other,
  weight,     ///< the weight of the arm and its payload
  slow,       ///< one joint's value, with at most two periods a turn: the torque of gravity often does the same
  wave,       ///< one joint's value, with many periods a turn: their number is the only constant, and is scanned for
  map,        ///< one joint's value in any way: a table of errors without a cause, which calibration leaves as it is
  time,       ///< time or temperature, which change slowly over a session
  jump,       ///< time, by a jump: its moment is the only constant, and is scanned for
  instrument  ///< angles and distances as the instrument at the origin of the measurements sees them
};

/// An arm and its measured poses, as discovery looks at them before it tries an effect.
struct TrialContext {
  const Chain& chain;
  const Eigen::MatrixXd& joints;                             ///< n x J: rad, mm for prismatic joints
  const std::map<std::string, Eigen::VectorXd>& covariates;  ///< by column name, n values each
  const Eigen::MatrixXd& loads;  ///< n x J: gravity's torque about each joint, N m; force along a prismatic joint, N
};

/// How discovery tries effects of a type. `index` is the joint or link, 0 for the whole robot. A function that is empty
/// stands for the usual.
struct EffectTrial {
  /// Constants to try, a hypothesis for each set of them. Usual: EffectConstant::usual.
  std::function<std::vector<std::vector<double>>(const TrialContext&, std::size_t index)> constants = {};
  /// Whether to try it there. Usual: yes.
  std::function<bool(const TrialContext&, std::size_t index)> is_worth_it = {};
  /// The part of its family's cause that it stands for there, e.g. "payload": another effect of the family may then
  /// stand beside it. Usual: "", the whole cause.
  std::function<std::string(const TrialContext&, std::size_t index)> part = {};
  /// Narrows the plausible range of the values to what these poses allow. Usual: EffectParameter::lower and upper.
  std::function<void(const TrialContext&, std::span<double> lower, std::span<double> upper)> narrow = {};
  bool fits_constant = false;  ///< the first constant, once it was chosen among those tried, is fitted with the values
};

/// The joint that an effect is at, as exported C source spells it.
struct CJoint {
  std::size_t index = 0;  ///< counted from 0
  bool is_prismatic = false;
  std::string q = {};                     ///< its value, rad (mm)
  std::string torque = {};                ///< gravity's torque about it, N m (force along it, N)
  std::vector<std::string> columns = {};  ///< values of EffectType::columns, in their order
};

/// How effects of a type are exported as C source, see robot_c_source.hpp.
struct EffectInC {
  /// An expression of C99 for what is added to the joint's value, rad (mm). Empty if the type is not exported.
  std::function<std::string(const CJoint&, std::span<const double> values, std::span<const double> constants)>
      expression = {};
  /// Functions that the expression calls, in an order in which C can read them; "@" stands for the name of the export.
  /// One of several effects is written once.
  std::vector<std::string> functions = {};
  /// Why there is no expression, if the place of the type does not say so: "it tilts the axis of a joint".
  std::string refusal = {};
};

/// A kind of effect. Values of 0 mean "not there" for every parameter that is estimated.
struct EffectType {
  std::string name;                        ///< as in files, e.g. "joint_compliance"
  std::string family = {};                 ///< effects of one family are variants of one cause, e.g. "joint_compliance"
  std::string title = {};                  ///< as an engineer says it
  std::string formula = {};                ///< full forward formula
  std::string source = {};                 ///< where the formula is from
  EffectPlace place = EffectPlace::joint;  ///< joint, link or the whole robot
  std::vector<EffectParameter> parameters = {};  ///< in the order of Effect::values
  std::vector<EffectConstant> constants = {};    ///< in the order of Effect::constants
  /// Covariates without which it cannot be evaluated, e.g. "temp_C"; "{}" stands for the number of the joint
  /// ("dir{}" is dir2 at the second joint), "time_s|order" for the first of these that is there.
  std::vector<std::string> columns = {};
  /// Adds the effect to the deformation; `index` is the joint or link. May be empty if `adjust` is there.
  std::function<void(const PoseContext&, std::size_t index, std::span<const double> values,
                     std::span<const double> constants, Deformation&)>
      apply = {};
  /// Changes what the effects are evaluated with (payload, gravity) before loads are summed and anything is applied.
  std::function<void(PoseContext&, std::span<const double> values)> adjust = {};
  Senses senses = Senses::nothing;
  Nature nature = Nature::other;
  bool scales_with_mass = false;  ///< values are inversely proportional to masses and share their relative uncertainty
  bool elastic = false;           ///< deforms under the arm's weight: the loads are those of the deformed arm
  bool linear = true;             ///< `apply` is linear in the values
  bool prismatic = true;          ///< may sit at a prismatic joint
  bool of_measuring = false;      ///< an error of the instrument or its session, not of the arm
  bool has_formula = false;       ///< its values are coefficients of the user's expressions, Effect::formula
  bool searched = true;           ///< discovery looks for it; false for reductions that are kept for comparison
  std::string note = {};          ///< where the plausible range is from
  /// Why an effect is refused that has the right numbers of values and constants, or nothing.
  std::function<std::string(const Chain&, std::size_t index, std::span<const double> constants)> refusal = {};
  EffectTrial trial = {};
  EffectInC in_c = {};
  /// Terms of a user's own effect, one for each parameter; "{}" stands for the number of the joint. Such a type has no
  /// `apply`; make_effect() makes an effect of type "formula" from it.
  std::vector<FormulaTerm> terms = {};
};

/// An effect of a given arm.
struct Effect {
  std::string type;            ///< EffectType::name
  std::string at;              ///< name of the joint, or of the joint that moves the link; empty for the whole robot
  std::vector<double> values;  ///< of the type's parameters
  std::vector<double> constants = {};  ///< of the type's constants
  Formula formula = {};                ///< of type "formula" only
};

}  // namespace llmt::robotics
