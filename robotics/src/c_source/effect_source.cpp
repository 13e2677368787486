#include "c_source/effect_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {
namespace {

// The reason why there is no expression: the row's own, or where the effect acts.
std::string reason_not_exported(const EffectType& type) {
  if (!type.in_c.refusal.empty()) return type.in_c.refusal;
  if (type.of_measuring) return "it is an error of the measurement, not of the arm";
  if (type.adjust) return "it changes the payload or the gravity that other effects are evaluated with";
  if (type.place == EffectPlace::link) return "it displaces a link";
  if (type.place == EffectPlace::robot) return "it displaces the whole arm";
  return "its row of the catalogue has no expression in C";
}

}  // namespace

std::string condition_of(const Chain& chain, std::size_t joint, const std::string& names) {
  const std::size_t bar = names.find('|');
  if (bar == std::string::npos) return names;
  return chain.joints[joint].type == JointType::prismatic ? names.substr(bar + 1) : names.substr(0, bar);
}

std::string effect_statement(const Chain& chain, const Effect& effect, const std::vector<std::string>& conditions) {
  const EffectType& type = effect_type(effect.type);
  const std::size_t j = effect_index(chain, effect);
  if (!type.in_c.expression) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::to_c: effect {} cannot be exported: {}. Effects that change a joint's value can.",
                    effect_label(effect), reason_not_exported(type)));
  }
  CJoint joint{.index = j,
               .is_prismatic = chain.joints[j].type == JointType::prismatic,
               .q = fmt::format("q[{}]", j),
               .torque = fmt::format("loads[{}].about_axis", j)};
  for (const std::string& names : effect_columns(chain, effect)) {
    const auto at = std::ranges::find(conditions, condition_of(chain, j, names));
    joint.columns.push_back(fmt::format("conditions[{}]", at - conditions.begin()));
  }
  return fmt::format("  more[{}] += {};\n", j, type.in_c.expression(joint, effect.values, effect.constants));
}

}  // namespace llmt::robotics
