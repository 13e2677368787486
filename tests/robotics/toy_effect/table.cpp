// The table of effects with a row more, linked instead of the library's.
#include <fmt/format.h>

#include "effects/effect_entries.hpp"
#include "effects/joint_error.hpp"

namespace llmt::robotics {

std::vector<EffectType> effect_table() {
  std::vector<EffectType> rows = library_effects();
  rows.push_back(
      {.name = "warm_gain",
       .family = "warm_gain",
       .formula = "dq_j = k (T - T0) q_j: the scale of an encoder grows with its temperature",
       .source = "made up",
       .parameters = {{.name = "growth", .unit = "1/K", .key = "growth_per_K"}},
       .constants = {{.name = "reference", .key = "reference_C", .usual = 20.0}},
       .columns = {"temp_C"},
       .apply = joint_error([](const PoseContext& pose, std::size_t j, Values values, Values constants) {
         return values[0] * (pose.columns[0] - constants[0]) * pose.q(static_cast<Eigen::Index>(j));
       }),
       .trial = {.constants = [](const TrialContext& context, std::size_t) -> std::vector<std::vector<double>> {
         return {{context.covariates.at("temp_C").mean()}};
       }},
       .in_c = {.expression = [](const CJoint& joint, Values values, Values constants) {
         return fmt::format("{} * ({} - {}) * {}", c_number(values[0]), joint.columns[0], c_number(constants[0]),
                            joint.q);
       }}});
  return rows;
}

std::string size_table() {
  return std::string(default_catalogue_yaml) + R"(
  - type: warm_gain
    title: encoder scale that grows with the temperature
    search: true
    note: made up
    parameters:
      growth: {scale: 1e-5, lower: -1e-3, upper: 1e-3}
)";
}

}  // namespace llmt::robotics
