#include "report/robot/discovery/discovery_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "report/robot/discovery/effect_text.hpp"

namespace llmt::report {
namespace {

using robotics::Discovery;
using robotics::FoundEffect;

constexpr std::size_t most_columns = 100;
constexpr std::size_t most_lines = 24;

std::string plain_value(double value, const std::string& unit) {
  const std::string text = number(value, 3);
  return unit == "1" ? text : text + " " + unit;
}

// Words of a paragraph in lines of at most a hundred columns; further lines are indented by four more.
std::vector<std::string> wrapped(const std::string& text) {
  std::vector<std::string> lines;
  const std::size_t indent = text.find_first_not_of(' ');
  std::string line;
  std::size_t begin = indent == std::string::npos ? text.size() : indent;
  std::string lead(begin, ' ');
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    begin = end + 1;
    if (!line.empty() && line.size() + 1 + word.size() > most_columns) {
      lines.push_back(line);
      lead = std::string(indent + 4, ' ');
      line.clear();
    }
    line += line.empty() ? lead + word : " " + word;
  }
  if (!line.empty()) lines.push_back(line);
  return lines;
}

std::string headline_text(robotics::Headline headline) {
  using robotics::Headline;
  switch (headline) {
    case Headline::nothing_missing:
      return "NOTHING MISSING. What the calibrated model leaves is noise as far as these poses can tell.";
    case Headline::named:
      return "NAMED. The model lacks:";
    case Headline::named_with_rivals:
      return "NAMED, BUT NOT ALONE. The model lacks the following. Other causes explain the data equally well; they "
             "stand behind \"instead it may be\":";
    case Headline::likely_causes:
      return "LIKELY CAUSES, NONE CERTAIN. Together these explain what the model lacks:";
    case Headline::gross_errors:
      return "TOO MANY OUTLIERS. Neither an effect nor its absence can be told from these data.";
    case Headline::structured_residuals:
      return "UNKNOWN EFFECT. No candidate explains what is left, but it is not an instrument's noise.";
    case Headline::named_in_part:
      return "UNKNOWN EFFECT, NAMED IN PART. Beside what has a name, something without a name is missing:";
    case Headline::likely_causes_in_part:
      return "LIKELY CAUSES, NONE CERTAIN. Beside them something is missing that the catalogue does not explain:";
    case Headline::unknown:
      return "UNKNOWN EFFECT. Something real is missing that the catalogue does not explain. It looks like this:";
  }
  return "";
}

// "joint1, joint3 and joint4"
std::string list_of(const std::vector<std::string>& names) {
  if (names.size() < 2) return names.empty() ? "" : names[0];
  return fmt::format("{} and {}", fmt::join(names.begin(), names.end() - 1, ", "), names.back());
}

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

  double rms_mm() const {
    double squares = 0.0;
    for (const FoundEffect* effect : members) squares += effect->rms_mm * effect->rms_mm;
    return std::sqrt(squares);
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

// One line for all places of one kind of effect.
std::vector<std::string> effect_sentences(const Discovery& found) {
  std::vector<std::string> sentences;
  for (const Group& group : groups_of(found)) {
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
  return sentences;
}

// One line for all patterns that act on one thing.
std::vector<std::string> pattern_sentences(const std::vector<robotics::FoundPattern>& patterns,
                                           const std::string& lead) {
  std::vector<std::string> order;
  std::map<std::string, std::vector<std::string>> by_place;
  for (const robotics::FoundPattern& one : patterns) {
    if (one.pattern.depends_on.empty()) continue;
    const std::string& place = one.pattern.acts_on;
    if (!by_place.contains(place)) order.push_back(place);
    by_place[place].push_back(pattern_words(one.pattern));
  }
  std::vector<std::string> sentences;
  for (const std::string& place : order) {
    sentences.push_back(fmt::format("  {}on {}: {}", lead, place, fmt::join(by_place[place], "; ")));
  }
  return sentences;
}

std::string with_article(const std::string& noun) {
  return (std::string("aeiou").find(noun.front()) == std::string::npos ? "a " : "an ") + noun;
}

std::vector<std::string> refused_sentences(const Discovery& found) {
  std::vector<std::string> sentences;
  for (const robotics::BeyondPlausible& one : found.beyond_plausible) {
    sentences.push_back(fmt::format("  {}{} would explain it, but at a {} of {}, beyond what is plausible (at {} {})",
                                    with_article(one.title), one.effect.at.empty() ? "" : ", " + one.effect.at + ",",
                                    one.parameter.name, plain_value(one.parameter.value, one.parameter.unit),
                                    one.parameter.value > one.limit ? "most" : "least",
                                    plain_value(one.limit, one.parameter.unit)));
  }
  return sentences;
}

std::vector<std::string> error_sentences(const Discovery& found) {
  const robotics::HeldOut& held = found.held_out;
  std::vector<std::string> lines;
  if (held.poses == 0) {
    lines.push_back(fmt::format("Mean error on the poses searched, none set aside: {:.4f} -> {:.4f} mm.",
                                found.fitted_before.mean, found.fitted_after.mean));
  } else {
    lines.push_back(
        fmt::format("Mean error on {} poses that took no part: {:.4f} -> {:.4f} mm (95 % {:.4f} -> {:.4f}, largest "
                    "{:.4f} -> {:.4f}).",
                    held.poses, held.before.mean, held.after.mean, held.before.p95, held.after.p95, held.before.max,
                    held.after.max));
  }
  lines.push_back(
      held.floor_from_repeats
          ? fmt::format("A perfect model would still miss by {:.4f} mm: the noise, measured by repeated poses.",
                        held.floor_mm)
          : fmt::format(
                "Too few poses were repeated to measure the noise. The error left on the fitted poses, {:.4f} mm, "
                "was used as the noise.",
                held.floor_mm));
  return lines;
}

// What the reader should do now.
std::string advice(const Discovery& found) {
  using robotics::Headline;
  if (found.answer == discovery::Answer::nothing_missing) return "";
  if (found.headline == Headline::gross_errors)
    return "Next: check the outliers, measure them again, and repeat the search without them.";
  if (found.headline == Headline::structured_residuals)
    return "Next: measure some poses several times, from both sides, and write their number into a column `pose`.";
  if (found.answer == discovery::Answer::indistinguishable) {
    return "Next: use the improved description near the measured poses. The last lines say whether further poses "
           "would tell the causes apart.";
  }
  if (found.answer == discovery::Answer::named)
    return "Next: use the improved description within the measured joint ranges. Nothing beyond was checked.";
  return "Next: use the improved description only near the measured poses. Elsewhere it may be no better.";
}

}  // namespace

std::string effect_values(const Discovery& found, const FoundEffect& effect) {
  std::vector<std::string> values;
  const std::vector<robotics::Joint>& joints = found.before.chain.joints;
  const auto first = std::ranges::find(joints, effect.effect.at, &robotics::Joint::name) - joints.begin();
  const bool by_body = robotics::effect_type(effect.effect.type).parameters[0].each_body;
  for (std::size_t k = 0; k < effect.parameters.size(); ++k) {
    const robotics::FoundParameter& parameter = effect.parameters[k];
    if (!std::isfinite(parameter.standard_error)) continue;
    const std::size_t body = static_cast<std::size_t>(first) + k / 3;
    const std::string name = by_body && body < joints.size()
                                 ? fmt::format("moment of {} along {}", joints[body].name, "xyz"[k % 3])
                                 : parameter.name;
    values.push_back(fmt::format("{} {}", name, with_unit(parameter.value, parameter.standard_error, parameter.unit)));
  }
  return fmt::format("{}", fmt::join(values, ", "));
}

std::string discovery_page(const Discovery& found, const std::vector<Eigen::Index>& lines_of_file) {
  std::vector<std::string> lines;
  const auto add = [&](const std::string& text) {
    for (std::string& line : wrapped(text)) lines.push_back(std::move(line));
  };
  add(headline_text(found.headline));
  for (const std::string& sentence : effect_sentences(found)) add(sentence);
  for (const std::string& sentence : pattern_sentences(found.unknown, "an error without a name, ")) add(sentence);
  for (const std::string& sentence : pattern_sentences(found.more, "and something more, ")) add(sentence);
  for (const std::string& sentence : refused_sentences(found)) add(sentence);
  if (!found.maps.empty()) {
    std::vector<std::string> joints;
    for (const robotics::Effect& map : found.maps) joints.push_back(map.at);
    add(fmt::format("  added to the model: free maps of the angle error of {}", list_of(joints)));
  }
  std::vector<std::string> body;
  std::swap(lines, body);
  for (const std::string& sentence : error_sentences(found)) add(sentence);
  if (!found.outliers.empty()) {
    std::vector<std::string> rows;
    for (const Eigen::Index row : found.outliers) rows.push_back(std::to_string(lines_of_file[row]));
    constexpr std::size_t shown = 20;
    const std::size_t more = rows.size() > shown ? rows.size() - shown : 0;
    rows.resize(rows.size() - more);
    add(fmt::format("Outliers, left out: line{} {}{}", rows.size() == 1 ? "" : "s", fmt::join(rows, ", "),
                    more > 0 ? fmt::format(" and {} more", more) : ""));
  }
  for (const std::string& note : found.notes) add(note);
  const std::string next = advice(found);
  if (!next.empty()) add(next);
  // What was found gives way to how good it is.
  const std::size_t room = lines.size() + 2 < most_lines ? most_lines - lines.size() - 2 : 1;
  if (body.size() > room) {
    const std::size_t left = body.size() - room + 1;
    body.resize(room - 1);
    body.push_back(fmt::format("  ... and {} lines more, below", left));
  }
  return fmt::format("{}\n\n{}\n\nDetails\n{}", fmt::join(body, "\n"), fmt::join(lines, "\n"),
                     discovery_details(found));
}

}  // namespace llmt::report
