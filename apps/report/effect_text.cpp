#include "report/effect_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "llmt/robotics/effects.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {

std::string with_unit(double value, double error, const std::string& unit) {
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
  const std::string name =
      unit.starts_with("1/") ? (best.factor == 1.0 ? unit : fmt::format("1e-{:.0f} {}", std::log10(best.factor), unit))
                             : best.name + unit;
  if (!std::isfinite(error)) return fmt::format("{} {} (not determined)", number(value * best.factor, 3), name);
  if (unit == "1") return fmt::format("{} +- {}", number(value, 3), number(error, 2));
  return fmt::format("{} +- {} {}", number(value * best.factor, 3), number(error * best.factor, 2), name);
}

std::string place_of(const robotics::FoundEffect& effect) {
  return effect.effect.at.empty() ? "the whole arm" : effect.effect.at;
}

std::string constants_of(const robotics::FoundEffect& effect) {
  const robotics::EffectType& type = robotics::effect_type(effect.effect.type);
  std::vector<std::string> parts;
  for (std::size_t k = 0; k < type.constants.size() && k < effect.effect.constants.size(); ++k) {
    parts.push_back(fmt::format("{} {}", type.constants[k].key, number(effect.effect.constants[k], 5)));
  }
  return parts.empty() ? "" : fmt::format(" ({})", fmt::join(parts, ", "));
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

}  // namespace llmt::apps
