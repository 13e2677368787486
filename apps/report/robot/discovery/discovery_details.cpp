#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <regex>

#include "report/robot/discovery/discovery_page.hpp"
#include "report/robot/discovery/effect_text.hpp"

namespace llmt::report {
namespace {

using robotics::Discovery;
using robotics::FoundEffect;

// "holds in 5 of 5 refits without a fifth of the poses: compliance 43 to 46 urad/(N m)".
std::string refits_words(const FoundEffect& effect) {
  std::vector<std::string> ranges;
  for (std::size_t k = 0; k < effect.ranges.size() && effect.parameters.size() <= 2; ++k) {
    const auto [low, high] = effect.ranges[k];
    const robotics::FoundParameter& parameter = effect.parameters[k];
    ranges.push_back(fmt::format("{} {}", parameter.name, range_with_unit(low, high, parameter.unit)));
  }
  return fmt::format("holds in {} of {} refits without a fifth of the poses{}{}", effect.held, effect.refits,
                     ranges.empty() ? "" : ": ", fmt::join(ranges, ", "));
}

// Every effect with all that is known of it.
std::string effect_lines(const Discovery& found) {
  std::string text;
  for (const FoundEffect* one : by_size(found)) {
    const FoundEffect& effect = *one;
    text +=
        fmt::format("  {}{}{}, {}{}\n", effect.confirmed ? "" : "perhaps ", effect.smaller ? "also " : "", effect.title,
                    effect.effect.at.empty() ? "the whole arm" : effect.effect.at, constants_of(effect));
    if (&whole_of(found, effect) != &effect) text += "    a part of the effect of this name above\n";
    const std::string values = effect_values(found, effect);
    if (!values.empty()) text += fmt::format("    {}\n", values);
    text += fmt::format("    moves the tool by {:.4f} mm\n", effect.rms_mm);
    if (effect.refits > 0) text += fmt::format("    {}\n", refits_words(effect));
    for (std::size_t k = 0; k < effect.rivals.size(); ++k) {
      text += fmt::format("    instead it may be: {} [{}]\n", rival_words(effect, k), effect.rivals[k]);
    }
    if (effect.exact_alias) text += "    One of these does the same at every pose: no pose can tell them apart.\n";
  }
  return text.empty() ? ""
                      : "Effects, and how far they move the tool (root mean square, without what a change of geometry "
                        "could imitate):\n" +
                            text;
}

std::string pattern_lines(const std::vector<robotics::FoundPattern>& patterns) {
  std::string text;
  for (const robotics::FoundPattern& one : patterns) {
    text += fmt::format("  on {}: {} ({:.0f} % of what was explained)\n", one.pattern.acts_on,
                        pattern_words(one.pattern), 100.0 * one.share);
  }
  return text.empty() ? "" : "Error patterns:\n" + text;
}

std::string gap_lines(const Discovery& found) {
  std::string text = "Where the calibrated model misses the measured points:\n";
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
    text += fmt::format(
        "  share of the squared error in the direction in which one joint moves the tool (33 % by chance): {}\n",
        list(found.gap.acts_like));
  }
  if (!found.gap.depends_on.empty()) text += fmt::format("  the error depends on: {}\n", list(found.gap.depends_on));
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
  return text.empty() ? "" : "Not testable with these data:\n" + text;
}

std::string visible_lines(const Discovery& found) {
  const VisibleSizes sizes = visible_sizes(found);
  std::string text = "An effect would have been found, nine times in ten, from this size on (best to worst place):\n";
  for (const auto& [type, range] : sizes.ranges) {
    text +=
        fmt::format("  {}: {} to {} {}\n", type, number(range.best_place, 2), number(range.worst_place, 2), range.unit);
  }
  if (!sizes.never.empty()) text += fmt::format("  not at any plausible size: {}\n", fmt::join(sizes.never, ", "));
  return text;
}

}  // namespace

std::string discovery_details(const Discovery& found) {
  std::vector<robotics::FoundPattern> patterns = found.unknown;
  patterns.insert(patterns.end(), found.more.begin(), found.more.end());
  std::erase_if(patterns, [](const robotics::FoundPattern& one) { return one.pattern.depends_on.empty(); });
  std::string text = effect_lines(found) + pattern_lines(patterns) + gap_lines(found) + untestable_lines(found);
  if (found.answer == discovery::Answer::nothing_missing) text += visible_lines(found);
  text += fmt::format(
      "{} causes were tried in {} round{}. What was found raises the score (log-likelihood) by {:.0f}; where there is "
      "nothing but noise, 997 of 1000 searches stay below {:.0f}.\n",
      found.hypotheses, found.rounds, found.rounds == 1 ? "" : "s", found.score_gain, found.threshold);
  return text;
}

}  // namespace llmt::report
