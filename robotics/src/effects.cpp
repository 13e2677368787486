#include "llmt/robotics/effects.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace llmt::robotics {
namespace {

constexpr double metres = 1e-3;

// Weight of everything from body `first` on and the payload: force in N, moment about `point` in N m.
struct Load {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
};

Load weight_from(const PoseContext& pose, std::size_t first, const Eigen::Vector3d& point) {
  Load load;
  const auto add = [&](double mass, const Eigen::Vector3d& centre) {
    const Eigen::Vector3d weight = mass * pose.gravity_m_s2;
    load.force += weight;
    load.moment += metres * (centre - point).cross(weight);
  };
  for (std::size_t k = first; k < pose.chain.joints.size(); ++k)
    add(pose.chain.joints[k].mass_kg, pose.skeleton.body_centre[k]);
  add(pose.payload_kg, pose.skeleton.payload_centre);
  return load;
}

void apply_joint_compliance(const PoseContext& pose, std::size_t j, std::span<const double> values,
                            Deformation& deformation) {
  const Load load = weight_from(pose, j, pose.skeleton.joint_origin[j]);
  const Eigen::Vector3d& axis = pose.skeleton.joint_axis[j];
  // A prismatic joint yields along its axis to the force; its compliance is then in m/N.
  if (pose.chain.joints[j].type == JointType::prismatic) {
    deformation.joint(static_cast<Eigen::Index>(j)) += values[0] * axis.dot(load.force) / metres;
  } else {
    deformation.joint(static_cast<Eigen::Index>(j)) += values[0] * axis.dot(load.moment);
  }
}

// A cantilever: unit chord, length in m, loads normal to the chord.
struct Beam {
  Eigen::Vector3d chord;
  double length;
  Eigen::Vector3d force;       // at the end, N
  Eigen::Vector3d own_weight;  // N/m
  Eigen::Vector3d moment;      // at the end, N m
};

Beam beam_of(const PoseContext& pose, std::size_t link) {
  const Eigen::Vector3d& end = pose.skeleton.link_end[link];
  const Eigen::Vector3d span = end - pose.skeleton.joint_origin[link];
  Beam beam{
      .chord = Eigen::Vector3d::UnitX(), .length = metres * span.norm(), .force = {}, .own_weight = {}, .moment = {}};
  if (beam.length > 0.0) beam.chord = span.normalized();
  const auto normal_part = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
    return v - beam.chord.dot(v) * beam.chord;
  };
  const Load load = weight_from(pose, link + 1, end);
  beam.force = normal_part(load.force);
  beam.moment = normal_part(load.moment);
  beam.own_weight = Eigen::Vector3d::Zero();
  if (beam.length > 0.0) {
    beam.own_weight = normal_part(pose.chain.joints[link].mass_kg / beam.length * pose.gravity_m_s2);
  }
  return beam;
}

void apply_link_bending(const PoseContext& pose, std::size_t link, std::span<const double> values,
                        Deformation& deformation) {
  const Beam beam = beam_of(pose, link);
  const double l = beam.length;
  const Eigen::Vector3d deflection = std::pow(l, 3) / 3.0 * beam.force + std::pow(l, 4) / 8.0 * beam.own_weight +
                                     l * l / 2.0 * beam.moment.cross(beam.chord);
  const Eigen::Vector3d slope = l * l / 2.0 * beam.chord.cross(beam.force) +
                                std::pow(l, 3) / 6.0 * beam.chord.cross(beam.own_weight) + l * beam.moment;
  deformation.link[link].translation_mm += values[0] * deflection / metres;
  deformation.link[link].rotation_rad += values[0] * slope;
}

void apply_link_bending_no_carry_over(const PoseContext& pose, std::size_t link, std::span<const double> values,
                                      Deformation& deformation) {
  const Beam beam = beam_of(pose, link);
  const Eigen::Vector3d deflection =
      std::pow(beam.length, 3) / 3.0 * beam.force + std::pow(beam.length, 4) / 8.0 * beam.own_weight;
  deformation.link[link].translation_mm += values[0] * deflection / metres;
}

std::vector<EffectType> make_effect_types() {
  // Bending stiffness of industrial arms 0.4-13 MN m^2, of a slender bar some 0.1 MN m^2.
  const EffectParameter flexibility = {"flexibility", "1/(N m^2)", "flexibility_per_Nm2", 1e-7, 0.0, 1e-4};
  return {
      {.name = "joint_compliance",
       .title = "joint compliance under gravity",
       .formula = "dq_j = c_j tau_j, tau_j = z_j . sum_{k >= j} (r_k - o_j) x m_k g, payload included",
       .source = "Khalil & Besnard 2002, geometric calibration of robots with flexible joints and links",
       .place = EffectPlace::joint,
       .parameters = {{"compliance", "rad/(N m)", "compliance_rad_per_Nm", 1e-7, 0.0, 1e-4}},
       .columns = {},
       .apply = apply_joint_compliance},
      {.name = "link_bending",
       .title = "link bending with moment and slope carried over",
       .formula = "d = (L^3/3 F + L^4/8 w + L^2/2 M x e) / EI, th = (L^2/2 e x F + L^3/6 e x w + L M) / EI",
       .source = "Euler-Bernoulli cantilever, any textbook on strength of materials",
       .place = EffectPlace::link,
       .parameters = {flexibility},
       .columns = {},
       .apply = apply_link_bending},
      {.name = "link_bending_no_carry_over",
       .title = "link bending, tip deflections only",
       .formula = "d = (L^3/3 F + L^4/8 w) / EI, no slope, no end moment",
       .source = "a documented reduction of link_bending",
       .place = EffectPlace::link,
       .parameters = {flexibility},
       .columns = {},
       .apply = apply_link_bending_no_carry_over},
  };
}

}  // namespace

const std::vector<EffectType>& effect_types() {
  static const std::vector<EffectType> types = make_effect_types();
  return types;
}

const EffectType& effect_type(std::string_view name) {
  std::string known;
  for (const EffectType& type : effect_types()) {
    if (type.name == name) return type;
    known += (known.empty() ? "" : ", ") + type.name;
  }
  throw std::invalid_argument(fmt::format("llmt::robotics: there is no effect \"{}\"; known: {}", name, known));
}

std::size_t effect_index(const Chain& chain, const Effect& effect) {
  const EffectType& type = effect_type(effect.type);
  if (effect.values.size() != type.parameters.size()) {
    throw std::invalid_argument(fmt::format("llmt::robotics: effect {} has {} values, must be {}", effect.type,
                                            effect.values.size(), type.parameters.size()));
  }
  return type.place == EffectPlace::robot ? 0 : joint_index(chain, effect.at);
}

std::string effect_parameter_name(const Effect& effect, const EffectParameter& parameter) {
  return effect.type + (effect.at.empty() ? "" : "@" + effect.at) + "." + parameter.name;
}

double round_bar_flexibility(double diameter_mm, double youngs_modulus_gpa) {
  const double inertia_m4 = std::numbers::pi * std::pow(metres * diameter_mm, 4) / 64.0;
  return 1.0 / (1e9 * youngs_modulus_gpa * inertia_m4);
}

double round_bar_mass(double diameter_mm, double length_mm, double density_kg_m3) {
  return density_kg_m3 * std::numbers::pi * std::pow(metres * diameter_mm, 2) / 4.0 * metres * length_mm;
}

}  // namespace llmt::robotics
