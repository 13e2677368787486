#include "robot/discovery_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <regex>
#include <set>

namespace llmt::apps {
namespace {

using robotics::Discovery;
using robotics::FoundEffect;

// A value with its error in the unit that needs no exponent: 1.1e-6 rad/(N m) is 1.10 +- 0.05 urad/(N m).
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

std::string place_of(const FoundEffect& effect) {
  return effect.effect.at.empty() ? "the whole arm" : effect.effect.at;
}

std::string constants_of(const FoundEffect& effect) {
  const robotics::EffectType& type = robotics::effect_type(effect.effect.type);
  std::vector<std::string> parts;
  for (std::size_t k = 0; k < type.constants.size() && k < effect.effect.constants.size(); ++k) {
    parts.push_back(fmt::format("{} {}", type.constants[k].key, number(effect.effect.constants[k], 5)));
  }
  return parts.empty() ? "" : fmt::format(" ({})", fmt::join(parts, ", "));
}

std::string headline(const Discovery& found) {
  switch (found.answer) {
    case discovery::Answer::nothing_missing:
      return "NOTHING MISSING. What the calibrated model leaves is noise as far as these poses can tell.";
    case discovery::Answer::named:
      return "NAMED. The model lacks:";
    case discovery::Answer::indistinguishable:
      return "NAMED, BUT NOT ALONE. The model lacks one of these:";
    case discovery::Answer::unknown:
      return "UNKNOWN EFFECT. Something real is missing that the catalogue does not explain. It looks like this:";
  }
  return "";
}

std::string effect_lines(const Discovery& found) {
  std::string text;
  for (const FoundEffect& effect : found.effects) {
    std::vector<std::string> values;
    for (const robotics::FoundParameter& parameter : effect.parameters) {
      values.push_back(
          fmt::format("{} {}", parameter.name, with_unit(parameter.value, parameter.standard_error, parameter.unit)));
    }
    text += fmt::format("  {}{}, {}{}\n    {}\n    moves the tool by {:.4f} mm (rms) in ways that geometry cannot\n",
                        effect.confirmed ? "" : "perhaps ", effect.title, place_of(effect), constants_of(effect),
                        fmt::join(values, ", "), effect.rms_mm);
    for (const std::string& rival : effect.rivals) text += fmt::format("    or as well: {}\n", rival);
    if (effect.exact_alias) text += "    One of these does the same at every pose: no pose can tell them apart.\n";
  }
  return text;
}

std::string shape_lines(const Discovery& found) {
  std::string text;
  for (const robotics::FoundShape& shape : found.unknown) {
    text += fmt::format("  acts on {}, depends on {}: {} ({:.0f} % of what was explained)\n", shape.shape.acts_on,
                        fmt::join(shape.shape.depends_on, ", "), shape.shape.kind, 100.0 * shape.share);
  }
  if (!found.maps.empty()) {
    std::vector<std::string> joints;
    for (const robotics::Effect& map : found.maps) joints.push_back(map.at);
    text += fmt::format("  added to the model: free maps of the angle error of {}\n", fmt::join(joints, ", "));
  }
  return text;
}

std::string error_line(const Discovery& found) {
  const robotics::HeldOut& held = found.held_out;
  const std::string floor =
      fmt::format("noise alone makes {:.4f} mm ({})", held.floor_mm,
                  held.floor_from_repeats ? "from the repeats" : "from what is left, so no lower bound of its own");
  if (held.poses == 0) {
    return fmt::format("Error on the poses that were searched, none set aside: {:.4f} -> {:.4f} mm mean; {}.\n",
                       found.fitted_before.mean, found.fitted_after.mean, floor);
  }
  return fmt::format(
      "Error on {} poses that took no part: {:.4f} -> {:.4f} mm mean, 95 % {:.4f} -> {:.4f}, largest {:.4f} -> {:.4f}; "
      "{}.\n",
      held.poses, held.before.mean, held.after.mean, held.before.p95, held.after.p95, held.before.max, held.after.max,
      floor);
}

std::string gap_lines(const Discovery& found) {
  const bool nothing = found.answer == discovery::Answer::nothing_missing;
  std::string text = nothing ? "What is left, by region:\n" : "Where the gap was, before:\n";
  if (found.gap.regions.empty()) text += "  about alike everywhere\n";
  for (const robotics::GapMap::Region& region : found.gap.regions) {
    text += fmt::format("  {:.4f} mm mean in {} poses: {}\n", region.mean_mm, region.poses, region.conditions);
  }
  const auto list = [](const std::vector<robotics::GapMap::Share>& shares) {
    std::vector<std::string> parts;
    for (const robotics::GapMap::Share& share : shares) {
      if (parts.size() < 4) parts.push_back(fmt::format("{} {:.0f} %", share.name, 100.0 * share.share));
    }
    return fmt::format("{}", fmt::join(parts, ", "));
  };
  if (!found.gap.acts_like.empty()) {
    text += fmt::format("  share of its square along the motion by each joint: {}\n", list(found.gap.acts_like));
  }
  if (!found.gap.depends_on.empty()) text += fmt::format("  a tree of it uses: {}\n", list(found.gap.depends_on));
  return text;
}

std::string untestable_lines(const Discovery& found) {
  std::map<std::string, std::vector<std::string>> by_reason;
  for (const discovery::UntestableCause& entry : found.not_testable) {
    // Columns of the single joints are one matter: dir1, dir2, ... are dirN.
    static const std::regex numbered("([a-z])[0-9]+(_|$|\\|)");
    by_reason[std::regex_replace(entry.why, numbered, "$1N$2")].push_back(entry.what);
  }
  std::string text;
  for (auto& [why, what] : by_reason) {
    std::map<std::string, int> types;
    for (const std::string& label : what) ++types[label.substr(0, label.find('@'))];
    std::vector<std::string> parts;
    for (const auto& [type, count] : types) parts.push_back(count > 1 ? fmt::format("{} ({})", type, count) : type);
    text += fmt::format("  {}: {}\n", why, fmt::join(parts, ", "));
  }
  return text.empty() ? "" : "Not testable:\n" + text;
}

std::string visible_lines(const Discovery& found) {
  std::map<std::string, std::pair<double, double>> ranges;
  std::map<std::string, std::string> units;
  std::set<std::string> beyond;
  for (const robotics::Visible& entry : found.visible) {
    const std::string type = entry.what.substr(0, entry.what.find_first_of("@["));
    if (!std::isfinite(entry.value) || entry.value > robotics::effect_type(type).parameters.front().upper) {
      beyond.insert(type);
      continue;
    }
    const auto [range, is_new] = ranges.try_emplace(type, entry.value, entry.value);
    range->second = {std::min(range->second.first, entry.value), std::max(range->second.second, entry.value)};
    units[type] = entry.unit;
  }
  std::string text = "Would have been seen, nine times in ten, from (best to worst place):\n";
  for (const auto& [type, range] : ranges) {
    beyond.erase(type);
    text += fmt::format("  {}: {} to {} {}\n", type, number(range.first, 2), number(range.second, 2),
                        units[type] == "1" ? "" : units[type]);
  }
  if (!beyond.empty()) text += fmt::format("  not at any plausible size: {}\n", fmt::join(beyond, ", "));
  return text;
}

}  // namespace

std::string discovery_page(const Discovery& found) {
  std::string text = headline(found) + "\n" + effect_lines(found) + shape_lines(found) + "\n" + error_line(found);
  for (const std::string& note : found.notes) text += note + "\n";
  text += "\n" + gap_lines(found);
  if (!found.outliers.empty()) {
    std::vector<std::string> rows;
    for (const Eigen::Index row : found.outliers) rows.push_back(std::to_string(row + 1));
    text += fmt::format("Outliers, left out (number of the measurement in the file): {}\n", fmt::join(rows, ", "));
  }
  text += untestable_lines(found);
  if (found.answer == discovery::Answer::nothing_missing) text += visible_lines(found);
  text += fmt::format("{} hypotheses in {} rounds; evidence {:.0f}, chance reaches {:.0f}.\n", found.hypotheses,
                      found.rounds, found.score_gain, found.threshold);
  return text;
}

}  // namespace llmt::apps
