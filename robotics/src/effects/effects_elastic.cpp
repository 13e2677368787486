// Effects of weight: compliance of joints, links and base, and what they are loaded with.
#include <algorithm>
#include <array>
#include <cmath>

#include "effects/effect_entries.hpp"

namespace llmt::robotics {
namespace {

using Values = std::span<const double>;

void apply_joint_compliance(const PoseContext& pose, std::size_t j, Values values, Values, Deformation& deformation) {
  // A prismatic joint yields along its axis to the force; its compliance is then in m/N.
  const double unit = is_prismatic(pose.chain, j) ? 1.0 / metres : 1.0;
  deformation.joint(j) += values[0] * unit * gravity_load(pose, j);
}

void apply_joint_compliance_stiffening(const PoseContext& pose, std::size_t j, Values values, Values constants,
                                       Deformation& deformation) {
  const double unit = is_prismatic(pose.chain, j) ? 1.0 / metres : 1.0;
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

// A link of no length has no direction, either: a shorter bar neither bends nor twists.
constexpr double shortest_bar_mm = 1.0;

// The straight bar that stands for a link, mm. DH parameters only tell where axes are: between (nearly) parallel axes
// the offset d along them is arbitrary, so the bar runs along the common normal a in the plane of the link's centre of
// mass; where d is the longer way, as in a forearm, it runs along the axis. The last link runs straight to the tool
// point.
struct Bar {
  Eigen::Vector3d start;
  Eigen::Vector3d end;
};

Bar bar_of(const PoseContext& pose, std::size_t link) {
  const Eigen::Vector3d& origin = pose.skeleton.joint_origin[link];
  const Eigen::Vector3d& end = pose.skeleton.link_end[link];
  if (link + 1 == pose.load.size()) return {origin, end};
  const Eigen::Vector3d& axis = pose.skeleton.joint_axis[link];
  const Eigen::Vector3d along = axis.dot(end - origin) * axis;
  const Eigen::Vector3d across = end - origin - along;
  if (across.squaredNorm() < along.squaredNorm()) return {origin, origin + along};
  const bool has_centre = pose.chain.joints[link].mass_kg > 0.0;
  const Eigen::Vector3d depth = has_centre ? axis.dot(pose.skeleton.body_centre[link] - origin) * axis : along;
  return {origin + depth, origin + depth + across};
}

// Weight of everything beyond a link, its moment about the end of the bar.
Load load_beyond(const PoseContext& pose, std::size_t link, const Eigen::Vector3d& end) {
  if (link + 1 < pose.load.size()) {
    Load load = pose.load[link + 1];
    load.moment_Nm += metres * (pose.skeleton.joint_origin[link + 1] - end).cross(load.force_N);
    return load;
  }
  const Eigen::Vector3d weight = pose.payload_kg * pose.gravity_m_s2;
  return {weight, metres * (pose.payload_centre_mm - end).cross(weight)};
}

// A cantilever: unit chord, length in m, loads normal to the chord.
struct Beam {
  Eigen::Vector3d chord;
  double length;
  Eigen::Vector3d end;     // mm
  Eigen::Vector3d force;   // at the end, N
  Eigen::Vector3d weight;  // of the link itself, N
  Eigen::Vector3d moment;  // at the end, N m
  double centre;           // of the link's own weight along the bar, as a share of the length
};

Beam beam_of(const PoseContext& pose, std::size_t link) {
  const Bar bar = bar_of(pose, link);
  const Eigen::Vector3d span = bar.end - bar.start;
  Beam beam{.chord = Eigen::Vector3d::UnitX(),
            .length = span.norm() < shortest_bar_mm ? 0.0 : metres * span.norm(),
            .end = bar.end,
            .force = {},
            .weight = Eigen::Vector3d::Zero(),
            .moment = {},
            .centre = 0.5};
  if (beam.length > 0.0) beam.chord = span.normalized();
  const auto normal_part = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
    return v - beam.chord.dot(v) * beam.chord;
  };
  const Load load = load_beyond(pose, link, bar.end);
  beam.force = normal_part(load.force_N);
  beam.moment = normal_part(load.moment_Nm);
  if (beam.length > 0.0) {
    beam.weight = normal_part(pose.chain.joints[link].mass_kg * pose.gravity_m_s2);
    beam.centre = beam.chord.dot(pose.skeleton.body_centre[link] - bar.start) * metres / beam.length;
  }
  return beam;
}

// End deflection (m EI) and slope (EI) of a cantilever under its own weight, the density of which changes in proportion
// to the way along it: m/L (1 + k (2 x/L - 1)), centre of mass at (1/2 + k/6) L. Uniform (k = 0): L^3/8, L^2/6 of the
// weight. A centre of mass beyond the middle third is as near as k = -1 or 1 comes.
std::array<double, 2> own_weight_factors(double length, double centre) {
  const double k = std::clamp(6.0 * (centre - 0.5), -1.0, 1.0);
  return {length * length * length * (1.0 / 8.0 + k * (11.0 / 60.0 - 1.0 / 8.0)),
          length * length * (1.0 / 6.0 + k * (1.0 / 4.0 - 1.0 / 6.0))};
}

void bend(const Beam& beam, double flexibility, std::size_t link, const PoseContext& pose, Deformation& deformation) {
  const double l = beam.length;
  const auto [sag, turn] = own_weight_factors(l, beam.centre);
  const Eigen::Vector3d deflection =
      l * l * l / 3.0 * beam.force + sag * beam.weight + l * l / 2.0 * beam.moment.cross(beam.chord);
  const Eigen::Vector3d slope = flexibility * (l * l / 2.0 * beam.chord.cross(beam.force) +
                                               turn * beam.chord.cross(beam.weight) + l * beam.moment);
  deformation.link[link].translation_mm +=
      flexibility * deflection / metres + slope.cross(pose.skeleton.link_end[link] - beam.end);
  deformation.link[link].rotation_rad += slope;
}

void apply_link_bending(const PoseContext& pose, std::size_t link, Values values, Values, Deformation& deformation) {
  bend(beam_of(pose, link), values[0], link, pose, deformation);
}

void apply_link_bending_no_carry_over(const PoseContext& pose, std::size_t link, Values values, Values,
                                      Deformation& deformation) {
  const Beam beam = beam_of(pose, link);
  const double l = beam.length;
  const Eigen::Vector3d deflection = l * l * l / 3.0 * beam.force + own_weight_factors(l, beam.centre)[0] * beam.weight;
  deformation.link[link].translation_mm += values[0] * deflection / metres;
}

void apply_link_torsion(const PoseContext& pose, std::size_t link, Values values, Values, Deformation& deformation) {
  const Bar bar = bar_of(pose, link);
  const double length = (bar.end - bar.start).norm();
  if (length < shortest_bar_mm) return;
  const Eigen::Vector3d chord = (bar.end - bar.start) / length;
  double torque = chord.dot(load_beyond(pose, link, bar.end).moment_Nm);
  // The link's own weight twists only the part of the bar before it.
  const Eigen::Vector3d centre = pose.skeleton.body_centre[link] - bar.start;
  const Eigen::Vector3d weight = pose.chain.joints[link].mass_kg * pose.gravity_m_s2;
  torque += std::clamp(chord.dot(centre) / length, 0.0, 1.0) * metres * chord.dot(centre.cross(weight));
  const Eigen::Vector3d turn = values[0] * metres * length * torque * chord;
  deformation.link[link].translation_mm += turn.cross(pose.skeleton.link_end[link] - bar.end);
  deformation.link[link].rotation_rad += turn;
}

void adjust_payload(PoseContext& pose, Values values) {
  if (!(pose.payload_kg > 0.0)) return;
  pose.payload_kg += values[0];
  pose.payload_centre_mm += pose.skeleton.tool.rotation * Eigen::Vector3d(values[1], values[2], values[3]);
}

// The two base axes that are most nearly horizontal: x and y as a rule, x and z of an arm whose plane holds gravity.
std::array<Eigen::Vector3d, 2> horizontal_axes(const PoseContext& pose) {
  Eigen::Index vertical = 0;
  pose.chain.gravity_m_s2.cwiseAbs().maxCoeff(&vertical);
  return {pose.skeleton.base_rotation.col(vertical == 0 ? 1 : 0),
          pose.skeleton.base_rotation.col(vertical == 2 ? 1 : 2)};
}

void adjust_gravity(PoseContext& pose, Values values) {
  const std::array<Eigen::Vector3d, 2> axes = horizontal_axes(pose);
  const Eigen::Vector3d turn = values[0] * axes[0] + values[1] * axes[1];
  const double angle = turn.norm();
  if (angle > 0.0) pose.gravity_m_s2 = Eigen::AngleAxisd(angle, turn / angle) * pose.gravity_m_s2;
}

// The moment of weights is horizontal, so one compliance for all directions needs no axes.
void apply_elastic_base(const PoseContext& pose, std::size_t, Values values, Values, Deformation& deformation) {
  deformation.base.rotation_rad += values[0] * pose.load[0].moment_Nm;
}

void apply_elastic_base_two(const PoseContext& pose, std::size_t, Values values, Values, Deformation& deformation) {
  const std::array<Eigen::Vector3d, 2> axes = horizontal_axes(pose);
  for (std::size_t k = 0; k < 2; ++k) {
    deformation.base.rotation_rad += values[k] * axes[k].dot(pose.load[0].moment_Nm) * axes[k];
  }
}

}  // namespace

std::vector<EffectType> elastic_effects() {
  const EffectParameter compliance = {.name = "compliance",
                                      .unit = "rad/(N m)",
                                      .key = "compliance_rad_per_Nm",
                                      .prismatic_unit = "m/N",
                                      .prismatic_key = "compliance_m_per_N"};
  const EffectParameter flexibility = {.name = "flexibility", .unit = "1/(N m^2)", .key = "flexibility_per_Nm2"};
  const std::string masses = "Khalil & Besnard 2002, geometric calibration of robots with flexible joints and links";
  const std::string beam = "Euler-Bernoulli cantilever, any textbook on strength of materials";
  return {
      {.name = "joint_compliance",
       .family = "joint_compliance",
       .formula = "dq_j = c_j tau_j, tau_j = z_j . sum_{k >= j} (r_k - o_j) x m_k g, payload included",
       .source = masses,
       .parameters = {compliance},
       .apply = apply_joint_compliance,
       .senses = Senses::torques,
       .weighted = true,
       .elastic = true},
      {.name = "joint_compliance_stiffening",
       .family = "joint_compliance",
       .formula = "dq_j = c_j s asinh(tau_j / s): compliance c at no load, which falls to half at 1.7 s",
       .source = "strain-wave gears have a smaller compliance under larger torques: K1 < K2 < K3 of their data sheets",
       .parameters = {compliance},
       .constants =
           {{.name = "stiffens_at", .key = "stiffens_at_Nm", .usual = 100.0, .prismatic_key = "stiffens_at_N"}},
       .apply = apply_joint_compliance_stiffening,
       .senses = Senses::torques,
       .weighted = true,
       .elastic = true,
       .refusal =
           [](const Chain&, std::size_t, Values constants) {
             return constants[0] > 0.0 ? std::string()
                                       : "stiffens_at is " + std::to_string(constants[0]) + ", must be > 0";
           }},
      {.name = "joint_compliance_measured",
       .family = "joint_compliance",
       .formula = "dq_j = c_j tau_j, tau_j as measured",
       .source = masses,
       .parameters = {{.name = "compliance", .unit = "rad/(N m)", .key = "compliance_rad_per_Nm"}},
       .columns = {"tau{}_Nm"},
       .apply = apply_joint_compliance_measured,
       .prismatic = false},
      {.name = "joint_compliance_free_masses",
       .family = "joint_compliance",
       .formula =
           "dq_j = sum_{k >= j} z_j . (R_k v_k) x g / |g|, v_k = compliance times the lumped mass moment of body "
           "k in its moving frame; for arms of revolute joints and one payload",
       .source = masses + "; lumping as in base inertial parameters, Gautier & Khalil 1990",
       .parameters = {{.name = "moment", .unit = "rad", .key = "moments_rad", .list = true}},
       .apply = apply_joint_compliance_free_masses,
       .senses = Senses::arm,
       .elastic = true,
       .prismatic = false,
       .count = [](const Chain& chain, std::size_t index) { return 3 * (chain.joints.size() - index); }},
      {.name = "link_bending",
       .family = "link_bending",
       .formula = "d = (L^3/3 F + L^4/8 w + L^2/2 M x e) / EI, th = (L^2/2 e x F + L^3/6 e x w + L M) / EI",
       .source = beam,
       .place = EffectPlace::link,
       .parameters = {flexibility},
       .apply = apply_link_bending,
       .senses = Senses::arm,
       .weighted = true},
      {.name = "link_bending_no_carry_over",
       .family = "link_bending",
       .formula = "d = (L^3/3 F + L^4/8 w) / EI, no slope, no end moment",
       .source = "a documented reduction of link_bending",
       .place = EffectPlace::link,
       .parameters = {flexibility},
       .apply = apply_link_bending_no_carry_over,
       .senses = Senses::arm},
      {.name = "link_torsion",
       .family = "link_torsion",
       .formula = "th = e L (M . e) / GJ: the moment of everything beyond the link's end twists it about its chord e",
       .source = "Saint-Venant torsion, any textbook on strength of materials",
       .place = EffectPlace::link,
       .parameters = {flexibility},
       .apply = apply_link_torsion,
       .senses = Senses::arm,
       .weighted = true},
      {.name = "elastic_base",
       .family = "elastic_base",
       .formula = "th = C_b M, M = moment of the arm's and payload's weight about the first joint's origin; everything "
                  "turns about that point",
       .source = "Khalil & Besnard 2002, elasticity of the first body's support",
       .place = EffectPlace::robot,
       .parameters = {{.name = "compliance", .unit = "rad/(N m)", .key = "compliance_rad_per_Nm"}},
       .apply = apply_elastic_base,
       .senses = Senses::arm,
       .weighted = true,
       .elastic = true},
      {.name = "elastic_base_two",
       .family = "elastic_base",
       .formula =
           "th = sum_i C_i (M . e_i) e_i over the two horizontal base axes e_i (x and y; x and z where gravity is "
           "along y, y and z where along x)",
       .source = "elastic_base, the stiffness of the support not alike in both directions",
       .place = EffectPlace::robot,
       .parameters = {{.name = "compliance_first", .unit = "rad/(N m)", .key = "compliance_first_rad_per_Nm"},
                      {.name = "compliance_second", .unit = "rad/(N m)", .key = "compliance_second_rad_per_Nm"}},
       .apply = apply_elastic_base_two,
       .senses = Senses::arm,
       .weighted = true,
       .elastic = true},
      {.name = "payload_error",
       .family = "payload_error",
       .formula = "where payload_kg > 0: m -> m + mass, centre -> centre + R_tool com; felt by the elastic effects",
       .source = "statics of the loaded arm",
       .place = EffectPlace::robot,
       .parameters = {{.name = "mass", .unit = "kg", .key = "mass_kg"},
                      {.name = "com_x", .unit = "mm", .key = "com_x_mm"},
                      {.name = "com_y", .unit = "mm", .key = "com_y_mm"},
                      {.name = "com_z", .unit = "mm", .key = "com_z_mm"}},
       .adjust = adjust_payload},
      {.name = "gravity_tilt",
       .family = "gravity_tilt",
       .formula =
           "g -> exp(first e_1 + second e_2) g, e_i the two horizontal base axes as in elastic_base_two; felt by "
           "the elastic effects",
       .source = "a base that is not level",
       .place = EffectPlace::robot,
       .parameters = {{.name = "first", .unit = "rad", .key = "first_rad"},
                      {.name = "second", .unit = "rad", .key = "second_rad"}},
       .adjust = adjust_gravity},
  };
}

}  // namespace llmt::robotics
