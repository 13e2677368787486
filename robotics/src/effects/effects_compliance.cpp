// Effects of weight on the joints: compliance.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "effects/effect_entries.hpp"
#include "effects/joint_error.hpp"

namespace llmt::robotics {
namespace {

void apply_joint_compliance(const PoseContext& pose, std::size_t j, Values values, Values, Deformation& deformation) {
  const double unit = compliance_unit(is_prismatic(pose.chain, j));
  deformation.joint(j) += values[0] * unit * gravity_load(pose, j);
}

void apply_joint_compliance_stiffening(const PoseContext& pose, std::size_t j, Values values, Values constants,
                                       Deformation& deformation) {
  const double unit = compliance_unit(is_prismatic(pose.chain, j));
  deformation.joint(j) += values[0] * unit * constants[0] * std::asinh(gravity_load(pose, j) / constants[0]);
}

void apply_joint_compliance_measured(const PoseContext& pose, std::size_t j, Values values, Values,
                                     Deformation& deformation) {
  deformation.joint(j) += values[0] * pose.columns[0];
}

void apply_joint_compliance_free_masses(const PoseContext& pose, std::size_t j, Values values, Values,
                                        Deformation& deformation) {
  const double gravity = pose.gravity_m_s2.norm();
  if (!(gravity > 0.0)) return;
  // z . (v x g) = v . (g x z), so one cross product serves all bodies.
  const Eigen::Vector3d lever = pose.gravity_m_s2.cross(pose.skeleton.joint_axis[j]) / gravity;
  double sum = 0.0;
  for (std::size_t k = j; k < pose.chain.joints.size(); ++k) {
    const Eigen::Map<const Eigen::Vector3d> v(values.data() + 3 * (k - j));
    if (v.isZero(0.0)) continue;
    sum += lever.dot(pose.skeleton.body_rotation[k] * v);
  }
  deformation.joint(j) += sum;
}

std::string joint_compliance_in_c(const CJoint& joint, Values values, Values) {
  return fmt::format("{} * {}", c_number(values[0] * compliance_unit(joint.is_prismatic)), joint.torque);
}

std::string joint_compliance_stiffening_in_c(const CJoint& joint, Values values, Values constants) {
  return fmt::format("{} * asinh({} / {})", c_number(values[0] * compliance_unit(joint.is_prismatic) * constants[0]),
                     joint.torque, c_number(constants[0]));
}

std::string joint_compliance_measured_in_c(const CJoint& joint, Values values, Values) {
  return fmt::format("{} * {}", c_number(values[0]), joint.columns[0]);
}

std::span<const Joint> from(const Chain& chain, std::size_t joint) { return std::span(chain.joints).subspan(joint); }

// If masses are unknown but payloads are told, the known torque is that of the payload alone: beside a compliance with
// free masses it is the other part of one cause, so both may stand at one joint.
std::string payload_alone(const TrialContext& context, std::size_t joint) {
  const auto payload = context.covariates.find("payload_kg");
  const bool is_alone =
      payload != context.covariates.end() && payload->second.maxCoeff() > payload->second.minCoeff() &&
      std::ranges::all_of(from(context.chain, joint), [](const Joint& body) { return body.mass_kg == 0.0; });
  return is_alone ? "payload" : "";
}

// With masses unknown and one payload the known torque is that of the payload alone, and so would be the compliance's
// size: that of the joint needs all of the torque.
bool has_all_of_the_torque(const TrialContext& context, std::size_t joint) {
  const auto payload = context.covariates.find("payload_kg");
  const bool is_of_payload =
      payload != context.covariates.end() && payload->second.size() > 0 &&
      payload->second.maxCoeff() == payload->second.minCoeff() &&
      std::ranges::all_of(from(context.chain, joint), [](const Joint& body) { return body.mass_kg == 0.0; });
  return !is_of_payload;
}

// Free masses have three unknowns per body and imitate many other effects: they are tried only where masses are
// unknown.
bool has_unknown_masses(const TrialContext& context, std::size_t joint) {
  return std::ranges::any_of(from(context.chain, joint), [](const Joint& body) { return !(body.mass_kg > 0.0); });
}

std::vector<std::vector<double>> bends_to_try(const TrialContext& context, std::size_t joint) {
  return shares_of_largest_torque(context, joint, {0.15, 0.4});
}

}  // namespace

std::vector<EffectType> compliance_effects() {
  const std::string masses = "Khalil & Besnard 2002, geometric calibration of robots with flexible joints and links";
  return {
      {.name = "joint_compliance",
       .family = "joint_compliance",
       .formula = "dq_j = c_j tau_j, tau_j = z_j . sum_{k >= j} (r_k - o_j) x m_k g, payload included",
       .source = masses,
       .parameters = {joint_compliance_parameter()},
       .apply = apply_joint_compliance,
       .senses = Senses::torques,
       .nature = Nature::weight,
       .scales_with_mass = true,
       .elastic = true,
       .trial = {.is_worth_it = has_all_of_the_torque, .part = payload_alone},
       .in_c = {.expression = joint_compliance_in_c}},
      {.name = "joint_compliance_stiffening",
       .family = "joint_compliance",
       .formula = "dq_j = c_j s asinh(tau_j / s): compliance c at no load, which falls to half at 1.7 s",
       .source = "strain-wave gears have a smaller compliance under larger torques: K1 < K2 < K3 of their data sheets",
       .parameters = {joint_compliance_parameter()},
       .constants =
           {{.name = "stiffens_at", .key = "stiffens_at_Nm", .usual = 100.0, .prismatic_key = "stiffens_at_N"}},
       .apply = apply_joint_compliance_stiffening,
       .senses = Senses::torques,
       .nature = Nature::weight,
       .scales_with_mass = true,
       .elastic = true,
       .refusal = [](const Chain&, std::size_t,
                     Values constants) { return must_be_positive("stiffens_at", constants[0]); },
       .trial = {.constants = bends_to_try, .is_worth_it = has_all_of_the_torque},
       .in_c = {.expression = joint_compliance_stiffening_in_c}},
      {.name = "joint_compliance_measured",
       .family = "joint_compliance",
       .formula = "dq_j = c_j tau_j, tau_j as measured",
       .source = masses,
       .parameters = {{.name = "compliance", .unit = "rad/(N m)", .key = "compliance_rad_per_Nm"}},
       .columns = {"tau{}_Nm"},
       .apply = apply_joint_compliance_measured,
       .prismatic = false,
       .in_c = {.expression = joint_compliance_measured_in_c}},
      {.name = "joint_compliance_free_masses",
       .family = "joint_compliance",
       .formula =
           "dq_j = sum_{k >= j} z_j . (R_k v_k) x g / |g|, v_k = compliance times the lumped mass moment of body "
           "k in its moving frame; for arms of revolute joints and one payload",
       .source = masses + "; lumping as in base inertial parameters, Gautier & Khalil 1990",
       .parameters = {{.name = "moment", .unit = "rad", .key = "moments_rad", .list = true, .each_body = true}},
       .apply = apply_joint_compliance_free_masses,
       .senses = Senses::arm,
       .nature = Nature::weight,
       .elastic = true,
       .prismatic = false,
       .trial = {.is_worth_it = has_unknown_masses},
       .in_c = {.refusal = "it needs the orientation of every body"}},
  };
}

}  // namespace llmt::robotics
