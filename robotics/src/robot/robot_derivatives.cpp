// Derivatives of readings, of arms that bend as well: what changes the arm changes what its effects look at, and with
// it the deformation, which changes the arm again.
//
// Let T be the reading, p the parameters, S the arm where the loads
// act, u = U(S, p) its deformation, in world coordinates. Then with the levers L = T_u (I - U_S S_u)^-1 the derivative
// is T_p + L (U_p + U_S S_p). A motion of the arm takes all that lies beyond along, twists included. Effects give them
// in the world, so a turn w takes w x u off.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "effects/effect_entries.hpp"
#include "kinematics/rotations.hpp"
#include "kinematics/units.hpp"
#include "robot/deformation_vector.hpp"
#include "robot/robot_evaluator.hpp"

namespace llmt::robotics {
namespace {

// d(exp(r + w) exp(r)^-1) / dw at w = 0: the turn per change of a rotation vector r, to its second order.
Eigen::Matrix3d turn_of_vector(const Eigen::Vector3d& r) {
  const Eigen::Matrix3d cross = cross_matrix(r);
  return Eigen::Matrix3d::Identity() + 0.5 * cross + cross * cross / 6.0;
}

// Balances truncation against rounding in central differences.
double difference_step(double value, double scale) {
  static const double relative = std::cbrt(std::numeric_limits<double>::epsilon());
  return relative * std::max(std::abs(value), scale);
}

// Where an effect jumps within the step, as a backlash where the torque changes its sign, the difference on the other
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
  trial_components_.clear();
  for (const Eigen::Index component : chosen) trial_components_.push_back(&component_of(trial_, component));
  place_.assign(component_count(q_.size()), -1);
  for (std::size_t k = 0; k < chosen.size(); ++k) place_[chosen[k]] = static_cast<Eigen::Index>(k);
}

// How a component of the deformation, none of world_mm, moves the arm: that where the loads act, or the deformed one.
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

// Of what is read, the rest of the deformation held as the arm has it.
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

// By an effect, the components in question.
void RobotEvaluator::flat_deformation(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect,
                                      Eigen::Ref<Eigen::VectorXd> out) {
  trial_.clear();
  apply(pose, row, effect, trial_);
  for (Eigen::Index k = 0; k < out.size(); ++k) out(k) = *trial_components_[k];
}

// Of the deformation by an effect, by one of its inputs. sides_ has the deformation as it is in column 1.
void RobotEvaluator::add_input(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect, std::size_t input) {
  const Place place = place_of(inputs_[input], pose, arm_, loads_);
  const int size = inputs_[input].kind == Input::Kind::payload ? 1 : 3;
  std::array<double, 3> given = {};
  std::copy_n(place.numbers, size, given.begin());
  for (int k = 0; k < place.count; ++k) {
    place.shift(k, -place.step);
    flat_deformation(pose, row, effect, sides_.col(0));
    std::copy_n(given.begin(), size, place.numbers);
    place.shift(k, place.step);
    flat_deformation(pose, row, effect, sides_.col(2));
    std::copy_n(given.begin(), size, place.numbers);
    auto column = by_input_.col(static_cast<Eigen::Index>(3 * input) + k);
    for (Eigen::Index c = 0; c < column.size(); ++c) {
      if (sides_(c, 0) == sides_(c, 2)) continue;
      column(c) += without_jump((sides_(c, 2) - sides_(c, 1)) / place.step, (sides_(c, 1) - sides_(c, 0)) / place.step);
    }
  }
}

void RobotEvaluator::set_inputs(PoseContext& pose, Eigen::Index row) {
  by_input_.setZero(std::ssize(components_), 3 * std::ssize(inputs_));
  sides_.resize(std::ssize(components_), 3);
  for (const PreparedEffect& effect : effects_) {
    if (effect.inputs.empty()) continue;
    flat_deformation(pose, row, effect, sides_.col(1));
    for (const std::size_t input : effect.inputs) add_input(pose, row, effect, input);
  }
  live_.clear();
  for (std::size_t k = 0; k < inputs_.size(); ++k) {
    if (!by_input_.middleCols<3>(static_cast<Eigen::Index>(3 * k)).isZero(0.0)) live_.push_back(k);
  }
}

// The arm in equilibrium, how its parameters move it, and what its effects answer. Where loads act on the deformed arm,
// the last pass hardly moves it.
void RobotEvaluator::prepare_derivatives(PoseContext& pose, Eigen::Index row) {
  tool_ = kinematics_.motions_into(deformed_motions_, q_, &deformation_);
  arm_tool_mm_ = tool_.position_mm - deformation_.world_mm;
  if (!bears_loads_) kinematics_.motions_into(motions_, q_);
  sum_weights(pose, weights_);
  set_inputs(pose, row);
  set_direct_levers(row);
}

// Of the deformation by one of its components.
void RobotEvaluator::set_response(const PoseContext& pose, Eigen::Index component,
                                  Eigen::Ref<Eigen::VectorXd> response) {
  response.setZero();
  if (component >= component_count(q_.size()) - 3) return;
  const Motion motion = component_motion(component, false);
  if (bears_loads_) {
    const ArmChange change = change_by(motion, pose);
    for (const std::size_t k : live_) {
      response += by_input_.middleCols<3>(static_cast<Eigen::Index>(3 * k))
                      .lazyProduct(input_change(pose, weights_, change, inputs_[k]));
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

// In equilibrium.
void RobotEvaluator::set_levers(const PoseContext& pose) {
  levers_ = direct_;
  const bool is_twisted = has_twists(deformation_);
  if ((bears_loads_ && !live_.empty()) || is_twisted) {
    const Eigen::Index count = std::ssize(components_);
    responses_.resize(count, count);
    for (Eigen::Index k = 0; k < count; ++k) set_response(pose, components_[k], responses_.col(k));
    // Each pass gains three digits, as in settle().
    for (int pass = 0; pass < 2; ++pass) levers_ = (direct_ + levers_.lazyProduct(responses_)).eval();
  }
  input_levers_ = levers_.lazyProduct(by_input_);
  held_back_.assign(q_.size() + 2, Eigen::Matrix3d::Zero());
  for (Eigen::Index twist = q_.size(); is_twisted && twist >= 0; --twist) {
    held_back_[twist] = held_back_[twist + 1];
    const Eigen::Index first = place_[per_twist * twist];
    if (first < 0) continue;
    const Deformation::Twist& held = twist_of(deformation_, twist);
    held_back_[twist] += levers_.middleCols<3>(first) * cross_matrix(held.translation_mm) +
                         levers_.middleCols<3>(first + 3) * cross_matrix(held.rotation_rad);
  }
}

// By the deformation that a change of the arm causes.
Eigen::Vector3d RobotEvaluator::reading_change(const PoseContext& pose, const ArmChange& change) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const std::size_t k : live_) {
    sum += input_levers_.middleCols<3>(static_cast<Eigen::Index>(3 * k)) *
           input_change(pose, weights_, change, inputs_[k]);
  }
  return sum;
}

// By a motion of the deformed arm, per mm or rad, and by what its effects answer if the arm where the loads act moves
// as well.
Eigen::Vector3d RobotEvaluator::by_motion(const PoseContext& pose, Eigen::Index row, const Motion& motion,
                                          const Motion* of_loads) const {
  Eigen::Vector3d sum = is_orientation(row) ? motion.turn() : motion.of(arm_tool_mm_);
  if (of_loads != nullptr && !live_.empty()) sum += reading_change(pose, change_by(*of_loads, pose));
  if (motion.turns) sum += held_back_[motion.first_twist] * motion.axis;
  return sum;
}

// From those of the components that the robot's own effects change to those of all.
void RobotEvaluator::extend_levers(const PoseContext& pose, Eigen::Index row) {
  const Eigen::Index count = component_count(q_.size());
  Eigen::Matrix3Xd all(3, count);
  for (Eigen::Index k = 0; k < count - 3; ++k) {
    const Motion motion = component_motion(k, true);
    all.col(k) = by_motion(pose, row, motion, bears_loads_ ? &motion : nullptr);
  }
  all.rightCols<3>().setZero();
  if (!is_orientation(row)) all.rightCols<3>().setIdentity();
  levers_ = all;
  std::vector<Eigen::Index> components(count);
  std::iota(components.begin(), components.end(), Eigen::Index{0});
  choose_components(components);
}

// Components x values: of the deformation by the values of an effect, at these values.
void RobotEvaluator::by_values(PoseContext& pose, Eigen::Index row, PreparedEffect& effect,
                               Eigen::Ref<Eigen::MatrixXd> out) {
  const std::vector<double> given = effect.values;
  for (Eigen::Index k = 0; k < out.cols(); ++k) {
    if (effect.type->linear) {
      std::ranges::fill(effect.values, 0.0);
      effect.values[k] = effect.scales[k];
      flat_deformation(pose, row, effect, out.col(k));
      out.col(k) /= effect.scales[k];
      continue;
    }
    const double step = difference_step(given[k], effect.scales[k]);
    Eigen::VectorXd below(out.rows());
    effect.values[k] = given[k] - step;
    flat_deformation(pose, row, effect, below);
    effect.values[k] = given[k] + step;
    flat_deformation(pose, row, effect, out.col(k));
    out.col(k) = (out.col(k) - below) / (2.0 * step);
    effect.values[k] = given[k];
  }
  effect.values = given;
}

// Of the reading by the values of an effect that changes payload or gravity for all others.
void RobotEvaluator::by_adjustments(const PoseContext& pose, Eigen::Index row, PreparedEffect& effect,
                                    bool is_candidate, Eigen::Ref<Eigen::Matrix3Xd> out) {
  constexpr double share = 0.01;
  const auto adjusted = [&](double& value, double to) {
    value = to;
    PoseContext moved = context(row);
    adjust(moved, row, is_candidate ? &effect : nullptr);
    return moved;
  };
  for (Eigen::Index k = 0; k < out.cols(); ++k) {
    double& value = effect.values[k];
    const double given = value;
    const double step = share * effect.scales[k];
    const PoseContext above = adjusted(value, given + step);
    const PoseContext below = adjusted(value, given - step);
    value = given;
    ArmChange change{.loads = true};
    change.gravity_m_s2 = (above.gravity_m_s2 - below.gravity_m_s2) / (2.0 * step);
    change.payload_kg = (above.payload_kg - below.payload_kg) / (2.0 * step);
    change.payload_centre_mm = (above.payload_centre_mm - below.payload_centre_mm) / (2.0 * step);
    out.col(k) = reading_change(pose, change);
  }
}

Eigen::Matrix3Xd RobotEvaluator::jacobian(Eigen::Index row) {
  if (effects_.empty()) {
    q_ = poses_.joints.row(row).transpose();
    Eigen::Matrix3Xd result =
        is_orientation(row) ? kinematics_.rotation_jacobian(q_) : kinematics_.position_jacobian(q_);
    if (observation(row) != nullptr) tool_ = kinematics_.forward(q_);
    chart(row, result);
    return result;
  }
  PoseContext pose = settle(row);
  choose_components(own_components_);
  prepare_derivatives(pose, row);
  set_levers(pose);
  Eigen::Index count = 0;
  for (const PreparedEffect& effect : effects_) count += std::ssize(effect.values);
  const Eigen::Index geometric = std::ssize(deformed_motions_);
  by_value_.setZero(direct_.cols(), count);
  Eigen::Index next = 0;
  for (PreparedEffect& effect : effects_) {
    const Eigen::Index own = std::ssize(effect.values);
    if (effect.apply) by_values(pose, row, effect, by_value_.middleCols(next, own));
    next += own;
  }
  Eigen::Matrix3Xd result(3, geometric + count);
  for (Eigen::Index k = 0; k < geometric; ++k) {
    const Motion& motion = deformed_motions_[k];
    result.col(k) =
        (motion.turns ? radians : 1.0) * by_motion(pose, row, motion, bears_loads_ ? &motion : &motions_[k]);
  }
  result.rightCols(count) = levers_.lazyProduct(by_value_);
  next = geometric;
  for (PreparedEffect& effect : effects_) {
    const Eigen::Index own = std::ssize(effect.values);
    if (effect.type->adjust) by_adjustments(pose, row, effect, false, result.middleCols(next, own));
    next += own;
  }
  chart(row, result);
  return result;
}

void RobotEvaluator::signatures(Eigen::Index row, std::vector<PreparedEffect>& candidates,
                                Eigen::Ref<Eigen::Matrix3Xd> out) {
  PoseContext pose = settle(row);
  choose_components(own_components_);
  prepare_derivatives(pose, row);
  set_levers(pose);
  extend_levers(pose, row);
  Eigen::Index next = 0;
  for (PreparedEffect& candidate : candidates) {
    const Eigen::Index own = std::ssize(candidate.values);
    candidate.values.assign(candidate.values.size(), 0.0);
    if (candidate.type->adjust) {
      by_adjustments(pose, row, candidate, true, out.middleCols(next, own));
    } else {
      by_value_.resize(levers_.cols(), own);
      by_values(pose, row, candidate, by_value_);
      out.middleCols(next, own) = levers_.lazyProduct(by_value_);
    }
    next += own;
  }
  chart(row, out);
}

}  // namespace llmt::robotics
