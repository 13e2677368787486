#include "c_source/effect_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {
namespace {

std::string harmonic(const Effect& effect, const std::string& angle) {
  return fmt::format("({} * cos({}) + {} * sin({}))", c_number(effect.values[0]), angle, c_number(effect.values[1]),
                     angle);
}

std::string eccentricity(const Effect& effect, const std::string& q) {
  const std::string a = c_number(effect.values[0]);
  const std::string b = c_number(effect.values[1]);
  return fmt::format("atan2({0} * cos({2}) + {1} * sin({2}), 1.0 + {0} * sin({2}) - {1} * cos({2}))", a, b, q);
}

std::string joint_map(const Effect& effect, const std::string& q) {
  std::string values;
  for (const double value : effect.values) values += c_number(value) + ", ";
  return fmt::format("@_map((const double[]){{{}}}, {}, ({} - {}) / {})", values, effect.values.size(), q,
                     c_number(effect.constants[0]), c_number(effect.constants[1]));
}

std::string spring(const Effect& effect, const std::string& q) {
  return fmt::format("@_spring({}, {}, {}, {}, {})", c_number(effect.values[0]), c_number(effect.values[1]),
                     c_number(effect.constants[0]), c_number(effect.constants[1]), q);
}

std::string wound(const Effect& effect, const std::string& move) {
  return fmt::format("(@_sign({0}) * (1.0 - 2.0 * exp(-fabs({0}) / {1})))", move, c_number(effect.constants[0]));
}

}  // namespace

std::string c_number(double value) {
  if (std::isinf(value)) return value > 0.0 ? "HUGE_VAL" : "-HUGE_VAL";
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string condition_of(const Chain& chain, std::size_t joint, const std::string& names) {
  const std::size_t bar = names.find('|');
  if (bar == std::string::npos) return names;
  return chain.joints[joint].type == JointType::prismatic ? names.substr(bar + 1) : names.substr(0, bar);
}

std::string effect_statement(const Chain& chain, const Effect& effect, const std::vector<std::string>& conditions) {
  const std::size_t j = effect_index(chain, effect);
  const std::string q = fmt::format("q[{}]", j);
  const std::string tau = fmt::format("loads[{}].about_axis", j);
  std::vector<std::string> columns;
  for (const std::string& names : effect_columns(chain, effect)) {
    const auto at = std::ranges::find(conditions, condition_of(chain, j, names));
    columns.push_back(fmt::format("conditions[{}]", at - conditions.begin()));
  }
  const std::string first = effect.values.empty() ? "0.0" : c_number(effect.values[0]);
  const double unit = chain.joints[j].type == JointType::prismatic ? 1000.0 : 1.0;
  const std::string& type = effect.type;
  std::string error;
  if (type == "joint_gain") error = first + " * " + q;
  if (type == "eccentricity") error = eccentricity(effect, q);
  if (type == "eccentricity_twice") error = harmonic(effect, "2.0 * " + q);
  if (type == "transmission_error") error = harmonic(effect, c_number(effect.constants[0]) + " * " + q);
  if (type == "joint_map") error = joint_map(effect, q);
  if (type == "counterbalance_spring") error = spring(effect, q);
  if (type == "wrist_coupling") error = fmt::format("{} * q[{}]", first, j - 1);
  if (type == "joint_compliance") error = fmt::format("{} * {}", c_number(effect.values[0] * unit), tau);
  if (type == "joint_compliance_measured") error = fmt::format("{} * {}", first, columns[0]);
  if (type == "backlash_gravity") error = fmt::format("{} * @_pressed(&loads[{}], @_slides[{}])", first, j, j);
  if (type == "backlash_gravity_soft") {
    error = fmt::format("{} * tanh({} / {})", first, tau, c_number(effect.constants[0]));
  }
  if (type == "backlash_approach") error = fmt::format("-({}) * @_sign({})", first, columns[0]);
  if (type == "hysteresis") error = fmt::format("-({}) * {}", first, wound(effect, columns[0]));
  if (type == "hysteresis_approach") {
    const std::string w = wound(effect, columns[0]);
    error = fmt::format("-({}) * {} - ({}) * (@_sign({}) - {})", first, w, c_number(effect.values[1]), columns[1], w);
  }
  if (type == "not_settled") error = fmt::format("-({}) * {}", first, columns[0]);
  if (error.empty()) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::to_c: effect {} is no change of a joint's value and cannot be exported",
                    effect_label(effect)));
  }
  return fmt::format("  more[{}] += {};\n", j, error);
}

}  // namespace llmt::robotics
