// Effects that repeat over the turns of a joint, and its table of errors.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "effects/effect_entries.hpp"
#include "effects/joint_error.hpp"

namespace llmt::robotics {
namespace {

// A mark at angle q on a unit circle, seen from a point that lies (b, -a) off the circle's centre, all in radii.
double eccentricity(const PoseContext& pose, std::size_t j, Values values, Values) {
  const double cosine = std::cos(pose.q(j));
  const double sine = std::sin(pose.q(j));
  return std::atan2(values[0] * cosine + values[1] * sine, 1.0 + values[0] * sine - values[1] * cosine);
}

double eccentricity_twice(const PoseContext& pose, std::size_t j, Values values, Values) {
  return harmonic(2.0 * pose.q(j), values);
}

double transmission_error(const PoseContext& pose, std::size_t j, Values values, Values constants) {
  return harmonic(constants[0] * pose.q(j), values);
}

double joint_map(const PoseContext& pose, std::size_t j, Values values, Values constants) {
  const double last = static_cast<double>(values.size() - 1);
  const double at = std::clamp((pose.q(j) - constants[0]) / constants[1], 0.0, last);
  const auto knot = std::min(static_cast<std::size_t>(at), values.size() - 1);
  const double beyond = at - static_cast<double>(knot);
  return beyond > 0.0 ? (1.0 - beyond) * values[knot] + beyond * values[knot + 1] : values[knot];
}

std::string eccentricity_in_c(const CJoint& joint, Values values, Values) {
  return fmt::format("atan2({0} * cos({2}) + {1} * sin({2}), 1.0 + {0} * sin({2}) - {1} * cos({2}))",
                     c_number(values[0]), c_number(values[1]), joint.q);
}

std::string eccentricity_twice_in_c(const CJoint& joint, Values values, Values) {
  return c_harmonic(values, "2.0 * " + joint.q);
}

std::string transmission_error_in_c(const CJoint& joint, Values values, Values constants) {
  return c_harmonic(values, c_number(constants[0]) + " * " + joint.q);
}

std::string joint_map_in_c(const CJoint& joint, Values values, Values constants) {
  std::string list;
  for (const double value : values) list += c_number(value) + ", ";
  return fmt::format("@_map((const double[]){{{}}}, {}, ({} - {}) / {})", list, values.size(), joint.q,
                     c_number(constants[0]), c_number(constants[1]));
}

const char* const c_map = R"(
static double @_map(const double *values, int count, double at) {
  int knot;
  at = at < 0.0 ? 0.0 : at > count - 1 ? count - 1 : at;
  knot = (int)at;
  at -= knot;
  return at > 0.0 ? (1.0 - at) * values[knot] + at * values[knot + 1] : values[knot];
}
)";

// Once a turn of the motor, and twice and four times.
std::vector<std::vector<double>> orders_of_the_gear(const TrialContext& context, std::size_t index) {
  const std::optional<double>& ratio = context.chain.joints[index].gear_ratio;
  if (!ratio) return {};
  return {{*ratio}, {2.0 * *ratio}, {4.0 * *ratio}};
}

}  // namespace

std::vector<EffectType> periodic_effects() {
  return {
      {.name = "eccentricity",
       .family = "eccentricity",
       .formula =
           "dq_j = atan2(a cos q_j + b sin q_j, 1 + a sin q_j - b cos q_j): a circle seen from off its centre by "
           "sqrt(a^2 + b^2) radii; to first order a cos q_j + b sin q_j",
       .source = "Judd & Knasinski 1990; Caenen & Angue 1990",
       .parameters = cosine_and_sine(),
       .apply = joint_error(eccentricity),
       .nature = Nature::slow,
       .linear = false,
       .prismatic = false,
       .in_c = {.expression = eccentricity_in_c}},
      {.name = "eccentricity_twice",
       .family = "eccentricity_twice",
       .formula = "dq_j = a cos 2 q_j + b sin 2 q_j: an elliptic ring, a tilted disc",
       .source = "Judd & Knasinski 1990",
       .parameters = cosine_and_sine(),
       .apply = joint_error(eccentricity_twice),
       .nature = Nature::slow,
       .prismatic = false,
       .in_c = {.expression = eccentricity_twice_in_c}},
      {.name = "transmission_error",
       .family = "transmission_error",
       .formula = "dq_j = a cos n q_j + b sin n q_j, n periods per turn; strain-wave gear: n = 2 gear ratio",
       .source = "Tuttle 1992; Slamani & Bonev 2013",
       .parameters = cosine_and_sine(),
       .constants = {{.name = "order_per_turn", .key = "order_per_turn", .usual = 100.0}},
       .apply = joint_error(transmission_error),
       .nature = Nature::wave,
       .prismatic = false,
       .refusal = [](const Chain&, std::size_t,
                     Values constants) { return must_be_positive("order_per_turn", constants[0]); },
       .trial = {.constants = orders_of_the_gear},
       .in_c = {.expression = transmission_error_in_c}},
      {.name = "joint_map",
       .family = "joint_map",
       .formula =
           "dq_j = values at equally spaced joint values first, first + step, ..., linear between, constant beyond",
       .source = "a table of errors, no physics",
       .parameters = {{.name = "value",
                       .unit = "rad",
                       .key = "values_rad",
                       .list = true,
                       .prismatic_unit = "mm",
                       .prismatic_key = "values_mm"}},
       .constants = {{.name = "first", .key = "first_rad", .usual = -std::numbers::pi, .prismatic_key = "first_mm"},
                     {.name = "step", .key = "step_rad", .usual = 0.1 * std::numbers::pi, .prismatic_key = "step_mm"}},
       .apply = joint_error(joint_map),
       .nature = Nature::map,
       .refusal = [](const Chain&, std::size_t, Values constants) { return must_be_positive("step", constants[1]); },
       .trial = {.constants = no_constants},
       .in_c = {.expression = joint_map_in_c, .functions = {c_map}}},
  };
}

}  // namespace llmt::robotics
