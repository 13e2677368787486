/// \file
/// What an effect and a kind of effect consist of.
///
///     const EffectType& type = effect_type("joint_compliance");
///     const std::string unit = type.parameters[0].unit;  // "rad/(N m)"
#pragma once

#include <Eigen/Core>
#include <functional>
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

/// What of an arm in a pose `apply` depends on, besides joint values and columns: what derivatives have to follow.
enum class Senses {
  nothing,
  torques,  ///< gravity's torque about its joint (force along it), or about the joints that a formula names
  arm       ///< points, axes, loads, gravity
};

/// What an effect is attached to.
enum class EffectPlace { joint, link, robot };

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
  bool weighted = false;      ///< values are inversely proportional to the masses and share their relative uncertainty
  bool elastic = false;       ///< deforms under the arm's weight: the loads are those of the deformed arm
  bool linear = true;         ///< `apply` is linear in the values
  bool prismatic = true;      ///< may sit at a prismatic joint
  bool of_measuring = false;  ///< an error of the instrument or its session, not of the arm
  bool searched = true;       ///< discovery looks for it; false for reductions that are kept for comparison
  std::string note = {};      ///< where the plausible range is from
  /// For a list parameter: number of values of an effect at `index`; empty function or 0: any number.
  std::function<std::size_t(const Chain&, std::size_t index)> count = {};
  /// Why an effect is refused that has the right numbers of values and constants, or nothing.
  std::function<std::string(const Chain&, std::size_t index, std::span<const double> constants)> refusal = {};
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
