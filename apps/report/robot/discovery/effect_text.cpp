#include "report/robot/discovery/effect_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "llmt/robotics/effects.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

// "presliding_rad" of 0.04 -> "presliding 0.04 rad".
std::string constant_words(std::string key, double value, const std::optional<double>& error) {
  std::string unit;
  for (const std::string suffix : {"rad", "mm", "Nm", "N", "C"}) {
    if (!key.ends_with("_" + suffix)) continue;
    unit = suffix == "Nm" ? " N m" : suffix == "C" ? " deg C" : " " + suffix;
    key.resize(key.size() - suffix.size() - 1);
  }
  if (key.ends_with("_share")) {
    key.resize(key.size() - std::string("_share").size());
    value *= 100.0;
    unit = " %";
  }
  std::ranges::replace(key, '_', ' ');
  return fmt::format("{} {:.5g}{}{}", key, value, error ? fmt::format(" +- {}", number(*error, 2)) : "", unit);
}

std::string constants_text(const robotics::Effect& effect, const std::optional<double>& error_of_first = {}) {
  const robotics::EffectType& type = robotics::effect_type(effect.type);
  std::vector<std::string> parts;
  for (std::size_t k = 0; k < type.constants.size() && k < effect.constants.size(); ++k) {
    parts.push_back(constant_words(type.constants[k].key, effect.constants[k], k == 0 ? error_of_first : std::nullopt));
  }
  return parts.empty() ? "" : fmt::format(" ({})", fmt::join(parts, ", "));
}

}  // namespace

namespace {

struct Scaled {
  double factor = 1.0;
  std::string unit;
};

// The unit in which a value has a digit or more in front of its point.
Scaled scaled(double value, const std::string& unit) {
  struct Prefix {
    double factor;
    const char* name;
  };
  const bool scales = unit.starts_with("rad") || unit.starts_with("1/(N") || unit.starts_with("1/K") || unit == "m/N";
  Prefix best{1.0, ""};
  if (scales && value != 0.0) {
    for (const Prefix& prefix : {Prefix{1e3, "m"}, Prefix{1e6, "u"}, Prefix{1e9, "n"}}) {
      if (std::abs(value) * best.factor < 0.1) best = prefix;
    }
  }
  if (!unit.starts_with("1/")) return {best.factor, best.name + unit};
  return {best.factor, best.factor == 1.0 ? unit : fmt::format("1e-{:.0f} {}", std::log10(best.factor), unit)};
}

}  // namespace

std::string with_unit(double value, double error, const std::string& unit) {
  const auto [factor, name] = scaled(value, unit);
  if (!std::isfinite(error)) return fmt::format("{} {} (not determined)", number(value * factor, 3), name);
  if (unit == "1") return fmt::format("{} +- {}", number(value, 3), number(error, 2));
  return fmt::format("{} +- {} {}", number(value * factor, 3), number(error * factor, 2), name);
}

std::string range_with_unit(double low, double high, const std::string& unit) {
  const auto [factor, name] = scaled(std::abs(low) > std::abs(high) ? low : high, unit);
  return fmt::format("{} to {}{}", number(low * factor, 3), number(high * factor, 3), unit == "1" ? "" : " " + name);
}

std::string place_of(const robotics::FoundEffect& effect) {
  return effect.effect.at.empty() ? "the whole arm" : effect.effect.at;
}

std::string constants_of(const robotics::FoundEffect& effect) {
  return constants_text(effect.effect, effect.constant_error);
}

std::vector<const robotics::FoundEffect*> by_size(const robotics::Discovery& found) {
  std::vector<const robotics::FoundEffect*> effects;
  for (const robotics::FoundEffect& effect : found.effects) effects.push_back(&effect);
  std::ranges::stable_sort(effects, std::greater<>(), &robotics::FoundEffect::rms_mm);
  return effects;
}

const robotics::FoundEffect& whole_of(const robotics::Discovery& found, const robotics::FoundEffect& effect) {
  if (!effect.smaller || robotics::nature_of(effect.effect) == robotics::Nature::wave) return effect;
  for (const robotics::FoundEffect& one : found.effects) {
    if (!one.smaller && one.effect.type == effect.effect.type && one.effect.at == effect.effect.at) return one;
  }
  return effect;
}

std::string effect_words(const robotics::Effect& effect) {
  const std::string& title =
      effect.formula.name.empty() ? robotics::effect_type(effect.type).title : effect.formula.name;
  return fmt::format("{}{}{}", title, effect.at.empty() ? "" : ", " + effect.at, constants_text(effect));
}

std::string parameter_words(const robotics::Robot& robot, const std::string& name) {
  for (const robotics::Effect& effect : robot.effects) {
    const std::string label = robotics::effect_label(effect);
    if (name == label) return effect_words(effect);
    if (!name.starts_with(label + ".")) continue;
    std::string parameter = name.substr(label.size() + 1);
    std::ranges::replace(parameter, '_', ' ');
    return fmt::format("{}: {}", effect_words(effect), parameter);
  }
  return name;
}

std::string rival_words(const robotics::FoundEffect& effect, std::size_t k) {
  const std::string& label = effect.rivals[k];
  const std::vector<robotics::Effect>& effects = effect.rival_effects[k];
  const auto causes = static_cast<std::size_t>(std::ranges::count(label, '+')) + 1;
  if (effects.size() != causes) return label;  // a pattern among them, which is no effect
  std::vector<std::string> parts;
  for (const robotics::Effect& one : effects) parts.push_back(effect_words(one));
  return fmt::format("{}", fmt::join(parts, " together with "));
}

std::string pattern_words(const robotics::ErrorPattern& pattern) {
  const std::string of = fmt::format(" of {}", fmt::join(pattern.depends_on, " and "));
  if (pattern.kind == "smooth") return "a smooth function" + of;
  if (pattern.kind == "a map of the joint") return "some function" + of;
  if (pattern.kind == "a function of two joints") return "a function" + of;
  if (pattern.kind == "nonlinear in the torque") return "a nonlinear function" + of;
  return pattern.kind + of;
}

VisibleSizes visible_sizes(const robotics::Discovery& found) {
  VisibleSizes sizes;
  for (const robotics::Visible& entry : found.visible) {
    const std::string type = entry.what.substr(0, entry.what.find_first_of("@["));
    if (!std::isfinite(entry.value) || entry.value > robotics::effect_type(type).parameters.front().upper) {
      sizes.never.insert(type);
      continue;
    }
    const std::string unit = entry.unit == "1" ? "" : entry.unit;
    VisibleRange& range = sizes.ranges.try_emplace(type, VisibleRange{entry.value, entry.value, unit}).first->second;
    range.best_place = std::min(range.best_place, entry.value);
    range.worst_place = std::max(range.worst_place, entry.value);
  }
  for (const auto& [type, range] : sizes.ranges) sizes.never.erase(type);
  return sizes;
}

}  // namespace llmt::report
