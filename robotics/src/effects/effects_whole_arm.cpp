// Effects of heat, time and mishaps on the arm or the instrument as a whole.
#include <cmath>

#include "effects/effect_entries.hpp"

namespace llmt::robotics {
namespace {

using Values = std::span<const double>;

double warming(const PoseContext& pose, Values constants) { return pose.columns[0] - constants[0]; }

Eigen::Vector3d vector_of(Values values, std::size_t first) {
  return {values[first], values[first + 1], values[first + 2]};
}

void apply_thermal_growth(const PoseContext& pose, std::size_t, Values values, Values constants,
                          Deformation& deformation) {
  const Eigen::Vector3d reach = pose.skeleton.tool.position_mm - pose.skeleton.joint_origin[0];
  deformation.world_mm += values[0] * warming(pose, constants) * reach;
}

void apply_link_thermal_growth(const PoseContext& pose, std::size_t link, Values values, Values constants,
                               Deformation& deformation) {
  const Eigen::Vector3d span = pose.skeleton.link_end[link] - pose.skeleton.joint_origin[link];
  deformation.link[link].translation_mm += values[0] * warming(pose, constants) * span;
}

void apply_base_thermal_drift(const PoseContext& pose, std::size_t, Values values, Values constants,
                              Deformation& deformation) {
  deformation.world_mm += warming(pose, constants) * vector_of(values, 0);
}

// 0 at the session's beginning, 1 at its end.
double session_time(const PoseContext& pose, Values constants) {
  return (pose.columns[0] - constants[0]) / (constants[1] - constants[0]);
}

void apply_drift(const PoseContext& pose, std::size_t, Values values, Values constants, Deformation& deformation) {
  deformation.world_mm += session_time(pose, constants) * vector_of(values, 0);
}

void apply_drift_curved(const PoseContext& pose, std::size_t, Values values, Values constants,
                        Deformation& deformation) {
  const double time = session_time(pose, constants);
  deformation.world_mm += time * vector_of(values, 0) + time * time * vector_of(values, 3);
}

void apply_drift_settling(const PoseContext& pose, std::size_t, Values values, Values constants,
                          Deformation& deformation) {
  deformation.world_mm += (1.0 - std::exp(-session_time(pose, constants) / constants[2])) * vector_of(values, 0);
}

void apply_tracker_knock(const PoseContext& pose, std::size_t, Values values, Values constants,
                         Deformation& deformation) {
  if (!(pose.columns[0] > constants[0])) return;
  deformation.base.translation_mm += vector_of(values, 0);
  deformation.base.rotation_rad += vector_of(values, 3);
}

EffectParameter in_mm(const std::string& name) { return {.name = name, .unit = "mm", .key = name + "_mm"}; }

std::string session_refusal(const Chain&, std::size_t, Values constants) {
  return constants[0] == constants[1] ? "from and to must differ" : "";
}

std::vector<EffectType> thermal_effects() {
  const std::vector<EffectConstant> reference = {{.name = "reference", .key = "reference_C", .usual = 20.0}};
  const EffectParameter expansion = {.name = "expansion", .unit = "1/K", .key = "expansion_per_K"};
  return {
      {.name = "thermal_growth",
       .family = "thermal_growth",
       .formula = "dp = alpha (T - T0)(p - o_1): every length grows alike",
       .source = "thermal expansion; Gong, Yuan & Ni 2000",
       .place = EffectPlace::robot,
       .parameters = {expansion},
       .constants = reference,
       .columns = {"temp_C"},
       .apply = apply_thermal_growth,
       .senses = Senses::arm},
      {.name = "link_thermal_growth",
       .family = "thermal_growth",
       .formula = "the end of the link moves by alpha (T - T0)(b - o_j), everything beyond with it",
       .source = "thermal expansion; Gong, Yuan & Ni 2000",
       .place = EffectPlace::link,
       .parameters = {expansion},
       .constants = reference,
       .columns = {"temp_C"},
       .apply = apply_link_thermal_growth,
       .senses = Senses::arm},
      {.name = "base_thermal_drift",
       .family = "thermal_growth",
       .formula = "dp = v (T - T0) in the world frame: the pedestal or the instrument's stand grows",
       .source = "thermal expansion",
       .place = EffectPlace::robot,
       .parameters = {{.name = "vx", .unit = "mm/K", .key = "vx_mm_per_K"},
                      {.name = "vy", .unit = "mm/K", .key = "vy_mm_per_K"},
                      {.name = "vz", .unit = "mm/K", .key = "vz_mm_per_K"}},
       .constants = reference,
       .columns = {"temp_C"},
       .apply = apply_base_thermal_drift},
  };
}

std::vector<EffectType> session_effects() {
  // In the unit of the column.
  const std::vector<EffectConstant> session = {{.name = "from", .key = "from", .usual = 0.0},
                                               {.name = "to", .key = "to", .usual = 1.0}};
  std::vector<EffectConstant> settling = session;
  settling.push_back({.name = "settles_in", .key = "settles_in_share", .usual = 0.2});
  return {
      {.name = "drift",
       .family = "drift",
       .formula = "dp = v t in the world frame, t = 0 ... 1 over the session",
       .source = "slow movement of instrument or base",
       .place = EffectPlace::robot,
       .parameters = {in_mm("vx"), in_mm("vy"), in_mm("vz")},
       .constants = session,
       .columns = {"time_s|order"},
       .apply = apply_drift,
       .of_measuring = true,
       .refusal = session_refusal},
      {.name = "drift_curved",
       .family = "drift",
       .formula = "dp = v t + w t^2 in the world frame, t = 0 ... 1 over the session",
       .source = "slow movement of instrument or base that settles",
       .place = EffectPlace::robot,
       .parameters = {in_mm("vx"), in_mm("vy"), in_mm("vz"), in_mm("wx"), in_mm("wy"), in_mm("wz")},
       .constants = session,
       .columns = {"time_s|order"},
       .apply = apply_drift_curved,
       .of_measuring = true,
       .refusal = session_refusal},
      {.name = "drift_settling",
       .family = "drift",
       .formula = "dp = v (1 - exp(-t / s)) in the world frame, t = 0 ... 1 over the session",
       .source = "an instrument or base that warms up: first-order response",
       .place = EffectPlace::robot,
       .parameters = {in_mm("vx"), in_mm("vy"), in_mm("vz")},
       .constants = settling,
       .columns = {"time_s|order"},
       .apply = apply_drift_settling,
       .of_measuring = true,
       .refusal =
           [](const Chain& chain, std::size_t index, Values constants) {
             if (!(constants[2] > 0.0)) return "settles_in is " + std::to_string(constants[2]) + ", must be > 0";
             return session_refusal(chain, index, constants);
           }},
      {.name = "tracker_knock",
       .family = "tracker_knock",
       .formula = "of rows later than `at`: dp = d + th x (p - o_1)",
       .source = "an instrument or base that was moved between two measurements",
       .place = EffectPlace::robot,
       .parameters = {in_mm("x"),
                      in_mm("y"),
                      in_mm("z"),
                      {.name = "rx", .unit = "rad", .key = "rx_rad"},
                      {.name = "ry", .unit = "rad", .key = "ry_rad"},
                      {.name = "rz", .unit = "rad", .key = "rz_rad"}},
       .constants = {{.name = "at", .key = "after", .usual = 0.0}},
       .columns = {"order|time_s"},
       .apply = apply_tracker_knock,
       .of_measuring = true},
  };
}

}  // namespace

std::vector<EffectType> whole_arm_effects() {
  std::vector<EffectType> all = thermal_effects();
  for (EffectType& type : session_effects()) all.push_back(std::move(type));
  return all;
}

}  // namespace llmt::robotics
