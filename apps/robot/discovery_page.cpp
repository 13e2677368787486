#include "robot/discovery_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "report/effect_text.hpp"

namespace llmt::apps {
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

std::string headline(const Discovery& found) {
  const auto refused = [&](const char* kind) { return !found.unknown.empty() && found.unknown[0].shape.kind == kind; };
  switch (found.answer) {
    case discovery::Answer::nothing_missing:
      return "NOTHING MISSING. What the calibrated model leaves is noise as far as these poses can tell.";
    case discovery::Answer::named:
      return "NAMED. The model lacks:";
    case discovery::Answer::indistinguishable:
      return "NAMED, BUT NOT ALONE. The model lacks the following; what stands behind \"or\" would do as well:";
    case discovery::Answer::unknown:
      if (refused("outliers"))
        return "TOO MANY OUTLIERS. Neither an effect nor its absence can be told from these data.";
      if (refused("noise"))
        return "UNKNOWN EFFECT. No candidate explains what is left, but it is not an instrument's noise.";
      if (std::ranges::any_of(found.effects, &FoundEffect::confirmed)) {
        return "NAMED IN PART. Beside what has a name, something is missing that the catalogue does not explain:";
      }
      return "UNKNOWN EFFECT. Something real is missing that the catalogue does not explain. It looks like this:";
  }
  return "";
}

// "joint1, joint3 and joint4"
std::string list_of(const std::vector<std::string>& names) {
  if (names.size() < 2) return names.empty() ? "" : names[0];
  return fmt::format("{} and {}", fmt::join(names.begin(), names.end() - 1, ", "), names.back());
}

// What an effect is, without its place: for gears, what turns so often.
std::string kind_of(const Discovery& found, const FoundEffect& effect) {
  if (effect.effect.type != "transmission_error") return effect.title;
  const double order = effect.effect.constants[0];
  const std::string what = fmt::format("an angle error that repeats {} times a turn", number(order, 5));
  for (const robotics::Joint& joint : found.before.chain.joints) {
    if (joint.name != effect.effect.at || !joint.gear_ratio) continue;
    if (std::abs(order - 2.0 * *joint.gear_ratio) < 0.02 * order) {
      return fmt::format("{}: the wave generator of a gear of {}", what, number(*joint.gear_ratio, 4));
    }
  }
  return what;
}

// One line for all places of one kind of effect.
std::vector<std::string> effect_sentences(const Discovery& found) {
  struct Group {
    std::string kind;
    std::vector<const FoundEffect*> members;
  };
  std::vector<Group> groups;
  for (const FoundEffect& effect : found.effects) {
    const std::string kind = (effect.confirmed ? "" : "perhaps ") +
                             std::string(effect.smaller ? "also, smaller: " : "") + kind_of(found, effect);
    const auto same = std::ranges::find(groups, kind, &Group::kind);
    if (same == groups.end()) {
      groups.push_back({kind, {&effect}});
    } else {
      same->members.push_back(&effect);
    }
  }
  std::vector<std::string> sentences;
  for (const Group& group : groups) {
    std::vector<std::string> places;
    std::vector<std::string> rivals;
    double squares = 0.0;
    for (const FoundEffect* effect : group.members) {
      places.push_back(effect->effect.at.empty() ? "the whole arm" : effect->effect.at);
      squares += effect->rms_mm * effect->rms_mm;
      for (const std::string& rival : effect->rivals) {
        if (std::ranges::find(rivals, rival) == rivals.end()) rivals.push_back(rival);
      }
    }
    std::string text = fmt::format("  {}, {}", group.kind, list_of(places));
    if (group.members.size() == 1) {
      const std::string values = effect_values(found, *group.members[0]);
      if (!values.empty() && values.size() < most_columns) text += ": " + values;
    }
    text += fmt::format("; moves the tool {:.4f} mm", std::sqrt(squares));
    for (std::size_t k = 0; k < std::min<std::size_t>(2, rivals.size()); ++k) text += "; or " + rivals[k];
    if (rivals.size() > 2) text += fmt::format("; or {} more", rivals.size() - 2);
    sentences.push_back(text);
  }
  return sentences;
}

// One line for all shapes that act on one thing.
std::vector<std::string> shape_sentences(const std::vector<robotics::FoundShape>& shapes, const std::string& lead) {
  std::vector<std::string> order;
  std::map<std::string, std::vector<std::string>> by_place;
  for (const robotics::FoundShape& one : shapes) {
    if (one.shape.depends_on.empty()) continue;
    const std::string& place = one.shape.acts_on;
    if (!by_place.contains(place)) order.push_back(place);
    by_place[place].push_back(fmt::format("{} of {}", one.shape.kind, fmt::join(one.shape.depends_on, " and ")));
  }
  std::vector<std::string> sentences;
  for (const std::string& place : order) {
    sentences.push_back(fmt::format("  {}{}: {}", lead, place, fmt::join(by_place[place], "; ")));
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
          ? fmt::format("A perfect model would leave {:.4f} mm: the noise by the repeats.", held.floor_mm)
          : fmt::format("There are too few repeats to know the noise: what is left, {:.4f} mm, was taken for it.",
                        held.floor_mm));
  return lines;
}

// What the reader should do now.
std::string advice(const Discovery& found) {
  const auto is = [&](const char* kind) { return !found.unknown.empty() && found.unknown[0].shape.kind == kind; };
  if (found.answer == discovery::Answer::nothing_missing) return "";
  if (is("outliers")) return "Next: check the outliers, measure them again, and repeat the search without them.";
  if (is("noise"))
    return "Next: measure some poses several times, from both sides, and write their number into a column `pose`.";
  if (found.answer == discovery::Answer::indistinguishable) {
    return "Next: use the improved description; the poses proposed below would tell the causes apart.";
  }
  if (found.answer == discovery::Answer::named)
    return "Next: use the improved description within the joint ranges that were measured.";
  return "Next: the improved description holds maps and corrections only where poses were measured; use it there.";
}

}  // namespace

std::string effect_values(const Discovery& found, const FoundEffect& effect) {
  std::vector<std::string> values;
  const std::vector<robotics::Joint>& joints = found.before.chain.joints;
  const auto first = std::ranges::find(joints, effect.effect.at, &robotics::Joint::name) - joints.begin();
  const bool by_body = effect.effect.type == "joint_compliance_free_masses";
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

std::string discovery_page(const Discovery& found) {
  std::vector<std::string> lines;
  const auto add = [&](const std::string& text) {
    for (std::string& line : wrapped(text)) lines.push_back(std::move(line));
  };
  add(headline(found));
  for (const std::string& sentence : effect_sentences(found)) add(sentence);
  for (const std::string& sentence : shape_sentences(found.unknown, "")) add(sentence);
  for (const std::string& sentence : shape_sentences(found.more, "and something more, on ")) add(sentence);
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
    for (const Eigen::Index row : found.outliers) rows.push_back(std::to_string(row + 1));
    constexpr std::size_t shown = 20;
    const std::size_t more = rows.size() > shown ? rows.size() - shown : 0;
    rows.resize(rows.size() - more);
    add(fmt::format("Outliers, left out (number of the measurement in the file): {}{}", fmt::join(rows, ", "),
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

}  // namespace llmt::apps
