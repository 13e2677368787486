// Derivatives of the reading by the deformation of an arm in equilibrium.
//
// Effects look at the arm in its pose: at loads, points and axes, their inputs. The inputs set the deformation of
// the arm. The deformed arm has other inputs, which deform it a little more.
//
// So a small extra deformation e moves the reading in several steps. By itself it moves it by D e (direct_). It also
// changes the inputs, and the effects answer with the deformation R e (responses_). They answer that with R R e, and so
// on. In sum the reading moves by L e, where L = D + D R + D R R + ... (levers_). R is of the size deflection / length,
// some thousandths.
//
// A parameter of the arm changes the inputs, too. The effects answer such a change with the deformation by_input_,
// which moves the reading by L by_input_ (input_levers_).
//
// Where a part of the arm turns, everything beyond it turns along, and with it the twists that bend links and base
// there. But effects give twists as vectors in the world. Their answer to the turn is counted from vectors that stay
// where they pointed. So for a turn w and a vector u of a twist, w x u is taken off (held_back_).
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "kinematics/rotations.hpp"
#include "robot/deformation_vector.hpp"
#include "robot/robot_evaluator.hpp"

namespace llmt::robotics {
namespace {

// d(exp(r + w) exp(r)^-1) / dw at w = 0: the turn per change of a rotation vector r, to its second order.
Eigen::Matrix3d turn_of_vector(const Eigen::Vector3d& r) {
  const Eigen::Matrix3d cross = cross_matrix(r);
  return Eigen::Matrix3d::Identity() + 0.5 * cross + cross * cross / 6.0;
}

// If an effect jumps within the step, as a backlash does when the torque changes its sign, the difference on the other
// side is the derivative. At a kink, as friction has there, it is the mean of both.
double without_jump(double forward, double backward) {
  constexpr double alike = 0.1;
  const double larger = std::max(std::abs(forward), std::abs(backward));
  const double smaller = std::min(std::abs(forward), std::abs(backward));
  if (larger - smaller <= alike * larger) return 0.5 * (forward + backward);
  return std::abs(forward) < std::abs(backward) ? forward : backward;
}

}  // namespace

void RobotEvaluator::choose_components(const std::vector<Eigen::Index>& chosen) {
  if (!components_.empty() && components_ == chosen) return;
  components_ = chosen;
  place_.assign(trial_components_.size(), -1);
  for (std::size_t k = 0; k < chosen.size(); ++k) place_[chosen[k]] = static_cast<Eigen::Index>(k);
}

// The motion of the arm by a component of the deformation other than world_mm: of the arm where the loads act, or of
// the deformed one.
Motion RobotEvaluator::component_motion(Eigen::Index component, bool of_deformed) const {
  const std::vector<Motion>& motions = of_deformed || bears_loads_ ? deformed_motions_ : motions_;
  const Eigen::Index joints = q_.size();
  const Eigen::Index first_joint = per_twist * (joints + 1);
  const auto motion_of = [&](std::size_t j) -> const Motion& {
    return motions[joint_parameter(j, is_prismatic(robot_.chain, j) ? JointParameter::d : JointParameter::theta)];
  };
  if (component >= first_joint) {
    const auto j = static_cast<std::size_t>(component - first_joint);
    Motion motion = motion_of(j);
    motion.axis *= robot_.chain.joints[j].sign;
    return motion;
  }
  const auto twist = static_cast<std::size_t>(component / per_twist);
  const Eigen::Index axis = component % per_twist;
  Motion motion{.axis = Eigen::Vector3d::Unit(axis % 3),
                .point = component < per_twist * joints ? motion_of(twist).point : arm_tool_mm_,
                .turns = axis >= 3,
                .first_joint = twist,
                .first_body = twist,
                .first_twist = twist + 1};
  if (motion.turns) {
    motion.axis = turn_of_vector(twist_of(deformation_, component / per_twist).rotation_rad).col(axis - 3);
  }
  return motion;
}

// Derivatives of the reading alone, the rest of the deformation held as the arm has it.
void RobotEvaluator::set_direct_levers(Eigen::Index row) {
  direct_.setZero(3, std::ssize(components_));
  const bool turns_only = is_orientation(row);
  const Eigen::Index first_of_world = component_count(q_.size()) - 3;
  for (Eigen::Index k = 0; k < direct_.cols(); ++k) {
    if (components_[k] >= first_of_world) {
      if (!turns_only) direct_(components_[k] - first_of_world, k) = 1.0;
      continue;
    }
    const Motion motion = component_motion(components_[k], true);
    direct_.col(k) = turns_only ? motion.turn() : motion.of(arm_tool_mm_);
  }
}

// The components that the effect may change, by this effect alone.
void RobotEvaluator::deformation_by(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect,
                                    Eigen::Ref<Eigen::VectorXd> out) {
  apply(pose, row, effect, trial_);
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    double& value = *trial_components_[effect.components[k]];
    out(k) = value;
    value = 0.0;
  }
}

// Derivatives of an effect's deformation by one of its inputs. sides_ has the deformation as it is in column 1.
void RobotEvaluator::add_input(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect, std::size_t input) {
  const Place place = place_of(inputs_[input], pose, arm_, loads_);
  const int size = inputs_[input].kind == Input::Kind::payload ? 1 : 3;
  const auto components = std::ssize(effect.components);
  std::array<double, 3> given = {};
  std::copy_n(place.numbers, size, given.begin());
  for (int k = 0; k < place.count; ++k) {
    place.shift(k, -place.step);
    deformation_by(pose, row, effect, sides_.col(0).head(components));
    std::copy_n(given.begin(), size, place.numbers);
    place.shift(k, place.step);
    deformation_by(pose, row, effect, sides_.col(2).head(components));
    std::copy_n(given.begin(), size, place.numbers);
    auto column = by_input_.col(static_cast<Eigen::Index>(3 * input) + k);
    for (Eigen::Index c = 0; c < components; ++c) {
      if (sides_(c, 0) == sides_(c, 2)) continue;
      column(place_[effect.components[c]]) +=
          without_jump((sides_(c, 2) - sides_(c, 1)) / place.step, (sides_(c, 1) - sides_(c, 0)) / place.step);
    }
  }
}

void RobotEvaluator::set_inputs(PoseContext& pose, Eigen::Index row) {
  by_input_.setZero(std::ssize(components_), 3 * std::ssize(inputs_));
  for (const PreparedEffect& effect : effects_) {
    if (effect.inputs.empty()) continue;
    deformation_by(pose, row, effect, sides_.col(1).head(std::ssize(effect.components)));
    for (const std::size_t input : effect.inputs) add_input(pose, row, effect, input);
  }
  live_.clear();
  for (std::size_t k = 0; k < inputs_.size(); ++k) {
    if (!by_input_.middleCols<3>(static_cast<Eigen::Index>(3 * k)).isZero(0.0)) live_.push_back(k);
  }
}

// Derivatives of the deformation by one of its components.
void RobotEvaluator::set_response(const PoseContext& pose, Eigen::Index component,
                                  Eigen::Ref<Eigen::VectorXd> response) {
  response.setZero();
  if (component >= component_count(q_.size()) - 3) return;
  const Motion motion = component_motion(component, false);
  if (bears_loads_) {
    const ArmChange change = change_by(motion, pose);
    for (const std::size_t k : live_) {
      const Eigen::Vector3d by_change = input_change(pose, weights_, change, inputs_[k]);
      if (by_change.isZero(0.0)) continue;
      response += by_input_.middleCols<3>(static_cast<Eigen::Index>(3 * k)).lazyProduct(by_change);
    }
  }
  if (!motion.turns) return;
  for (auto twist = static_cast<Eigen::Index>(motion.first_twist); twist <= q_.size(); ++twist) {
    const Eigen::Index first = place_[per_twist * twist];
    if (first < 0) continue;
    const Deformation::Twist& carried = twist_of(deformation_, twist);
    response.segment<3>(first) -= motion.axis.cross(carried.translation_mm);
    response.segment<3>(first + 3) -= motion.axis.cross(carried.rotation_rad);
  }
}

// L of the comment above, without what the arm has nothing of.
void RobotEvaluator::settle_levers(const PoseContext& pose) {
  levers_ = direct_;
  if (!(bears_loads_ && !live_.empty()) && !has_twists(deformation_)) return;
  const Eigen::Index count = std::ssize(components_);
  responses_.resize(count, count);
  for (Eigen::Index k = 0; k < count; ++k) set_response(pose, components_[k], responses_.col(k));
  // Each pass gains three digits, as in settle().
  for (int pass = 0; pass < 2; ++pass) levers_ = (direct_ + levers_.lazyProduct(responses_)).eval();
}

void RobotEvaluator::set_held_back() {
  held_back_.clear();
  if (!has_twists(deformation_)) return;
  held_back_.assign(q_.size() + 2, Eigen::Matrix3d::Zero());
  for (Eigen::Index twist = q_.size(); twist >= 0; --twist) {
    held_back_[twist] = held_back_[twist + 1];
    const Eigen::Index first = place_[per_twist * twist];
    if (first < 0) continue;
    const Deformation::Twist& held = twist_of(deformation_, twist);
    held_back_[twist] += levers_.middleCols<3>(first) * cross_matrix(held.translation_mm) +
                         levers_.middleCols<3>(first + 3) * cross_matrix(held.rotation_rad);
  }
}

// Levers of the arm in equilibrium, by the components that its own effects change. The last pass to equilibrium hardly
// moved the points at which loads act on the deformed arm.
void RobotEvaluator::set_levers(PoseContext& pose, Eigen::Index row) {
  choose_components(own_components_);
  tool_ = kinematics_.motions_into(deformed_motions_, q_, &deformation_);
  arm_tool_mm_ = tool_.position_mm - deformation_.world_mm;
  set_inputs(pose, row);
  set_direct_levers(row);
  const bool follows_arm = !live_.empty() || has_twists(deformation_);
  if (follows_arm && !bears_loads_) kinematics_.motions_into(motions_, q_);
  if (!live_.empty()) sum_weights(pose, weights_);
  settle_levers(pose);
  input_levers_ = levers_.lazyProduct(by_input_);
  set_held_back();
}

// By the deformation that a change of the arm causes.
Eigen::Vector3d RobotEvaluator::reading_change(const PoseContext& pose, const ArmChange& change) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const std::size_t k : live_) {
    const Eigen::Vector3d by_change = input_change(pose, weights_, change, inputs_[k]);
    if (by_change.isZero(0.0)) continue;  // most parts of the arm stay where they are
    sum += input_levers_.middleCols<3>(static_cast<Eigen::Index>(3 * k)) * by_change;
  }
  return sum;
}

// By a motion of the deformed arm, per mm or rad, and by what its effects answer if the arm where the loads act moves
// as well.
Eigen::Vector3d RobotEvaluator::by_motion(const PoseContext& pose, Eigen::Index row, const Motion& motion,
                                          const Motion* of_loads) const {
  Eigen::Vector3d sum = is_orientation(row) ? motion.turn() : motion.of(arm_tool_mm_);
  if (of_loads != nullptr && !live_.empty()) sum += reading_change(pose, change_by(*of_loads, pose));
  if (motion.turns && !held_back_.empty()) sum += held_back_[motion.first_twist] * motion.axis;
  return sum;
}

// From the components that the robot's own effects change to all.
void RobotEvaluator::extend_levers(const PoseContext& pose, Eigen::Index row) {
  const auto count = std::ssize(trial_components_);
  levers_.resize(3, count);
  for (Eigen::Index k = 0; k < count - 3; ++k) {
    const Motion motion = component_motion(k, true);
    levers_.col(k) = by_motion(pose, row, motion, bears_loads_ ? &motion : nullptr);
  }
  levers_.rightCols<3>().setZero();
  if (!is_orientation(row)) levers_.rightCols<3>().setIdentity();
  std::vector<Eigen::Index> components(count);
  std::iota(components.begin(), components.end(), Eigen::Index{0});
  choose_components(components);
}

}  // namespace llmt::robotics
