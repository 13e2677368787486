#include "report/robot/discovery/effect_sentences.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "report/robot/discovery/discovery_page.hpp"
#include "report/robot/discovery/effect_text.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

using robotics::Discovery;
using robotics::FoundEffect;

// "155", "27.7".
std::string order_text(double order) {
  return order == std::round(order) ? fmt::format("{:.0f}", order) : number(order, 3);
}

bool is_wave(const FoundEffect& effect) { return robotics::nature_of(effect.effect) == robotics::Nature::wave; }

// What an effect is, without its place: for gears, what turns so often.
std::string kind_of(const Discovery& found, const FoundEffect& effect) {
  if (!is_wave(effect)) return effect.title;
  const double order = effect.effect.constants[0];
  const std::string what = fmt::format("an angle error that repeats {} times a turn", order_text(order));
  for (const robotics::Joint& joint : found.before.chain.joints) {
    if (joint.name != effect.effect.at || !joint.gear_ratio) continue;
    if (std::abs(order - 2.0 * *joint.gear_ratio) < 0.02 * order) {
      return fmt::format("{}: the wave generator of a gear of {}", what, number(*joint.gear_ratio, 4));
    }
  }
  return what;
}

// Effects that one line speaks of.
struct Group {
  std::string kind;
  std::vector<const FoundEffect*> members = {};
  bool small_waves = false;

  // Displacements by effects that are alike may add up to less than the root of their squares.
  double rms_mm() const {
    double squares = 0.0;
    std::map<std::string, double> families;
    for (const FoundEffect* effect : members) {
      squares += effect->rms_mm * effect->rms_mm;
      double& family = families[robotics::effect_type(effect->effect.type).family];
      family = std::max(family, std::pow(effect->family_rms_mm, 2));
    }
    double most = 0.0;
    for (const auto& [family, own] : families) most += own;
    return std::sqrt(std::min(squares, most));
  }
};

// The waves of gears that hardly move the tool: those below a quarter of the largest wave, and of each certainty those
// beyond the five largest. Fewer than two are not worth a line of their own.
std::vector<const FoundEffect*> small_waves(const std::vector<const FoundEffect*>& effects, bool confirmed) {
  constexpr int most = 5;
  constexpr double small = 0.25;
  double largest = 0.0;
  int shown = 0;
  std::vector<const FoundEffect*> waves;
  for (const FoundEffect* effect : effects) {
    if (!is_wave(*effect) || !effect->rivals.empty()) continue;
    largest = std::max(largest, effect->rms_mm);
    if (effect->confirmed != confirmed) continue;
    if (shown == most || effect->rms_mm < small * largest) {
      waves.push_back(effect);
    } else {
      ++shown;
    }
  }
  return waves.size() < 2 ? std::vector<const FoundEffect*>{} : waves;
}

// What moves the tool most first.
std::vector<Group> groups_of(const Discovery& found) {
  const std::vector<const FoundEffect*> effects = by_size(found);
  std::vector<Group> groups;
  std::vector<const FoundEffect*> taken;
  for (const bool confirmed : {true, false}) {
    std::vector<const FoundEffect*> small = small_waves(effects, confirmed);
    if (small.empty()) continue;
    taken.insert(taken.end(), small.begin(), small.end());
    groups.push_back({confirmed ? "small waves of the gears" : "perhaps small waves of the gears", small, true});
  }
  for (const FoundEffect* effect : effects) {
    if (std::ranges::find(taken, effect) != taken.end()) continue;
    const FoundEffect& whole = whole_of(found, *effect);
    const std::string kind = (whole.confirmed ? "" : "perhaps ") + std::string(whole.smaller ? "also, smaller: " : "") +
                             kind_of(found, whole);
    const auto same = std::ranges::find(groups, kind, &Group::kind);
    if (same == groups.end()) {
      groups.push_back({kind, {effect}});
    } else {
      same->members.push_back(effect);
    }
  }
  std::ranges::stable_sort(groups, std::greater<>(), &Group::rms_mm);
  return groups;
}

// "joint1 (21 and 80.5 times a turn), joint2 (20)", joints in the order of the arm.
std::string wave_places(const Discovery& found, const Group& waves) {
  std::vector<std::string> places;
  for (const robotics::Joint& joint : found.before.chain.joints) {
    std::vector<std::string> orders;
    for (const FoundEffect* effect : waves.members) {
      if (effect->effect.at == joint.name) orders.push_back(order_text(effect->effect.constants[0]));
    }
    if (!orders.empty()) {
      places.push_back(
          fmt::format("{} ({}{})", joint.name, fmt::join(orders, ", "), places.empty() ? " times a turn" : ""));
    }
  }
  return fmt::format("{}", fmt::join(places, ", "));
}

}  // namespace

std::string list_of(const std::vector<std::string>& names) {
  if (names.size() < 2) return names.empty() ? "" : names[0];
  return fmt::format("{} and {}", fmt::join(names.begin(), names.end() - 1, ", "), names.back());
}

std::vector<std::string> effect_sentences(const Discovery& found) {
  std::vector<std::string> sentences;
  std::vector<std::string> tentative;
  const bool any_is_confirmed = std::ranges::any_of(found.effects, &FoundEffect::confirmed);
  for (const Group& group : groups_of(found)) {
    if (any_is_confirmed && !whole_of(found, *group.members.front()).confirmed) {
      for (const FoundEffect* effect : group.members) {
        const std::string what = fmt::format("{}, {}", kind_of(found, *effect), place_of(*effect));
        if (std::ranges::find(tentative, what) == tentative.end()) tentative.push_back(what);
      }
      continue;
    }
    std::vector<std::string> places;
    std::vector<std::string> rivals;
    for (const FoundEffect* effect : group.members) {
      if (std::ranges::find(places, place_of(*effect)) == places.end()) places.push_back(place_of(*effect));
      if (&whole_of(found, *effect) != effect) continue;  // what could replace a part is in the details
      for (std::size_t k = 0; k < effect->rivals.size(); ++k) {
        const std::string rival = rival_words(*effect, k);
        if (std::ranges::find(rivals, rival) == rivals.end()) rivals.push_back(rival);
      }
    }
    std::string text =
        fmt::format("  {}, {}", group.kind, group.small_waves ? wave_places(found, group) : list_of(places));
    if (group.members.size() == 1 && !is_wave(*group.members[0])) {  // the size of a wave says it all
      const std::string values = effect_values(found, *group.members[0]);
      if (!values.empty() && values.size() < most_columns) text += ": " + values;
    }
    text += fmt::format("; {} the tool {:.4f} mm", group.small_waves ? "together they move" : "moves", group.rms_mm());
    constexpr std::size_t shown = 2;
    for (std::size_t k = 0; k < std::min(shown, rivals.size()); ++k) {
      text += (k == 0 ? "; instead it may be: " : "; or: ") + rivals[k];
    }
    if (rivals.size() > shown) text += fmt::format("; or one of {} more, see below", rivals.size() - shown);
    sentences.push_back(text);
  }
  if (tentative.empty()) return sentences;
  constexpr std::size_t most = 3;
  const std::size_t more = tentative.size() > most ? tentative.size() - most : 0;
  tentative.resize(tentative.size() - more);
  sentences.push_back(fmt::format("  not certain, see below: {}{}", fmt::join(tentative, "; "),
                                  more > 0 ? fmt::format("; and {} more", more) : ""));
  return sentences;
}

}  // namespace llmt::report
