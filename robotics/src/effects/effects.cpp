#include "llmt/robotics/effects.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>

#include "effects/effect_entries.hpp"

namespace llmt::robotics {
namespace {

[[noreturn]] void refuse(const std::string& message) { throw std::invalid_argument("llmt::robotics: " + message); }

// Number of values of an effect at a joint, 0 if its type leaves it open.
std::size_t value_count(const EffectType& type, const Chain& chain, std::size_t index) {
  const bool is_list = type.parameters.size() == 1 && type.parameters[0].list;
  if (!is_list) return type.parameters.size();
  return type.parameters[0].each_body ? 3 * (chain.joints.size() - index) : 0;
}

std::string count_refusal(const EffectType& type, const Chain& chain, const Effect& effect, std::size_t index) {
  const std::size_t own = value_count(type, chain, index);
  std::size_t wanted = own > 0 ? own : std::max<std::size_t>(1, effect.values.size());
  if (type.has_formula) wanted = effect.formula.terms.size();
  if (effect.values.size() != wanted) return fmt::format("has {} values, must be {}", effect.values.size(), wanted);
  if (effect.constants.size() == type.constants.size()) return "";
  return fmt::format("has {} constants, must be {}", effect.constants.size(), type.constants.size());
}

std::string place_refusal(const EffectType& type, const Chain& chain, std::size_t index,
                          std::span<const double> constants) {
  if (type.place == EffectPlace::joint && !type.prismatic && is_prismatic(chain, index)) {
    return fmt::format("{} is prismatic", chain.joints[index].name);
  }
  return type.refusal ? type.refusal(chain, index, constants) : "";
}

// A coefficient has the unit of what its term acts on, as if the expression had none.
std::vector<EffectParameter> formula_parameters(const EffectParameter& usual, const Formula& formula, bool slides) {
  std::vector<EffectParameter> all;
  for (const FormulaTerm& term : formula.terms) {
    all.push_back(usual);
    all.back().name = term.name.empty() ? fmt::format("{}_{}", usual.name, all.size()) : term.name;
    all.back().unit = term.acts_on == "joint" && !slides ? "rad" : "mm";
    if (!term.unit.empty()) all.back().unit = term.unit;
    all.back().scale = scale_of(term, slides);
  }
  return all;
}

}  // namespace

std::string with_joint_number(std::string pattern, std::size_t joint) {
  for (std::size_t at = pattern.find("{}"); at != std::string::npos; at = pattern.find("{}", at)) {
    pattern.replace(at, 2, std::to_string(joint + 1));
  }
  return pattern;
}

bool is_of_whole_robot(const EffectType& type, const Effect& effect) {
  return type.place == EffectPlace::robot || (type.has_formula && effect.at.empty());
}

const EffectType& effect_type(std::string_view name) {
  const auto type = std::ranges::find(effect_types(), name, &EffectType::name);
  if (type != effect_types().end()) return *type;
  std::vector<std::string> known;
  for (const EffectType& other : effect_types()) known.push_back(other.name);
  refuse(fmt::format("there is no effect \"{}\"; known: {}", name, fmt::join(known, ", ")));
}

Nature nature_of(const Effect& effect) { return effect_type(effect.type).nature; }

bool suits(const EffectType& type, const Chain& chain, std::size_t index, std::string* why) {
  std::vector<double> usual;
  for (const EffectConstant& constant : type.constants) usual.push_back(constant.usual);
  const std::string reason = place_refusal(type, chain, index, usual);
  if (why != nullptr) *why = reason;
  return reason.empty();
}

std::size_t effect_index(const Chain& chain, const Effect& effect) {
  const EffectType& type = effect_type(effect.type);
  const std::size_t index = is_of_whole_robot(type, effect) ? 0 : joint_index(chain, effect.at);
  std::string reason = count_refusal(type, chain, effect, index);
  if (reason.empty()) reason = place_refusal(type, chain, index, effect.constants);
  if (reason.empty() && type.has_formula) reason = formula_refusal(chain, effect);
  if (!reason.empty()) refuse(fmt::format("effect {}: {}", effect_label(effect), reason));
  return index;
}

Effect make_effect(const EffectType& type, const Chain& chain, std::size_t index, std::vector<double> constants,
                   std::size_t count) {
  Effect effect{.type = type.terms.empty() ? type.name : "formula", .at = {}, .values = {}};
  if (type.place != EffectPlace::robot) effect.at = chain.joints.at(index).name;
  effect.constants = std::move(constants);
  if (effect.constants.empty()) {
    for (const EffectConstant& constant : type.constants) effect.constants.push_back(constant.usual);
  }
  if (!type.terms.empty()) effect.formula.name = type.name;
  effect.formula.terms = type.terms;
  for (FormulaTerm& term : effect.formula.terms) term.text = with_joint_number(term.text, index);
  const std::size_t own = value_count(type, chain, index);
  effect.values.assign(own > 0 ? own : count, 0.0);
  effect_index(chain, effect);
  return effect;
}

std::vector<EffectParameter> effect_parameters(const Chain& chain, const Effect& effect) {
  return effect_parameters(effect_type(effect.type), chain, effect);
}

std::vector<EffectParameter> effect_parameters(const EffectType& type, const Chain& chain, const Effect& effect) {
  if (!type.terms.empty()) return type.parameters;
  std::vector<EffectParameter> all;
  const bool slides = type.place == EffectPlace::joint && !is_of_whole_robot(type, effect) &&
                      is_prismatic(chain, joint_index(chain, effect.at));
  if (type.has_formula) return formula_parameters(type.parameters[0], effect.formula, slides);
  for (EffectParameter parameter : type.parameters) {
    if (slides && !parameter.prismatic_key.empty()) {
      parameter.unit = parameter.prismatic_unit;
      parameter.key = parameter.prismatic_key;
      const double factor = parameter.unit == "mm" ? 1000.0 : 1.0;
      for (double* size : {&parameter.scale, &parameter.lower, &parameter.upper}) *size *= factor;
    }
    if (!parameter.list) {
      all.push_back(parameter);
      continue;
    }
    for (std::size_t k = 1; k <= effect.values.size(); ++k) {
      all.push_back(parameter);
      all.back().name += fmt::format("_{}", k);
    }
  }
  return all;
}

std::vector<std::string> effect_columns(const Chain& chain, const Effect& effect) {
  const EffectType& type = effect_type(effect.type);
  if (type.has_formula) return formula_columns(effect.formula.terms);
  const std::size_t index = type.place == EffectPlace::robot ? 0 : joint_index(chain, effect.at);
  std::vector<std::string> columns;
  for (const std::string& pattern : type.columns) columns.push_back(with_joint_number(pattern, index));
  return columns;
}

std::vector<std::string> alternatives(const std::string& columns) {
  std::vector<std::string> names;
  for (std::size_t begin = 0; begin <= columns.size();) {
    const std::size_t end = std::min(columns.find('|', begin), columns.size());
    names.push_back(columns.substr(begin, end - begin));
    begin = end + 1;
  }
  return names;
}

std::string effect_label(const Effect& effect) {
  std::string label = effect.type;
  if (!effect.at.empty()) label += "@" + effect.at;
  if (!effect.formula.name.empty()) label += "[" + effect.formula.name + "]";
  if (!effect.constants.empty()) label += fmt::format("[{}]", fmt::join(effect.constants, ","));
  return label;
}

Effect joint_map_effect(const Joint& joint, double first, double step, std::vector<double> values) {
  return {.type = "joint_map", .at = joint.name, .values = std::move(values), .constants = {first, step}};
}

std::string effect_parameter_name(const Effect& effect, const EffectParameter& parameter) {
  return effect_label(effect) + "." + parameter.name;
}

}  // namespace llmt::robotics
