#include "report/robot/discovery/discovery_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <sstream>

#include "report/robot/discovery/effect_sentences.hpp"
#include "report/robot/discovery/effect_text.hpp"
#include "report/robot/measurement_text.hpp"

namespace llmt::report {
namespace {

using robotics::Discovery;
using robotics::FoundEffect;

constexpr std::size_t most_lines = 24;

std::string plain_value(double value, const std::string& unit) {
  const std::string text = number(value, 3);
  return unit == "1" ? text : text + " " + unit;
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
    case Headline::likely_causes_unwritten:
      return "LIKELY CAUSES, NONE WRITTEN. They explain the poses searched, but do not make the poses set aside "
             "better:";
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

// What explains most: squares of what geometry and the other effects cannot imitate, summed over places.
std::string largest_sentence(const Discovery& found) {
  const double squares = found.fitted_before.rms * found.fitted_before.rms;
  if (found.effects.empty() || found.withdrawn || !(squares > 0.0)) return "";
  std::map<std::string, double> of_title;
  for (const FoundEffect& effect : found.effects) of_title[effect.title] += effect.rms_mm * effect.rms_mm;
  const auto largest = std::ranges::max_element(of_title, {}, [](const auto& entry) { return entry.second; });
  return fmt::format("Of what has a name, \"{}\" explains most: {:.0f} % of the squared error at the poses searched.",
                     largest->first, 100.0 * std::min(1.0, largest->second / squares));
}

std::vector<std::string> error_sentences(const Discovery& found) {
  const robotics::HeldOut& held = found.held_out;
  std::vector<std::string> lines;
  if (const std::string largest = largest_sentence(found); !largest.empty()) lines.push_back(largest);
  lines.insert(lines.end(), found.could_state.begin(), found.could_state.end());
  if (held.poses == 0) {
    lines.push_back(fmt::format("Mean error on the poses searched, none set aside: {:.4f} -> {:.4f} mm.",
                                found.fitted_before.mean, found.fitted_after.mean));
  } else {
    lines.push_back(fmt::format(
        "Mean error on {} poses {}: {:.4f} -> {:.4f} mm (95 % {:.4f} -> {:.4f}, largest {:.4f} -> {:.4f}).", held.poses,
        held.rows.empty() ? "that took no part" : "of what was found without them", held.before.mean, held.after.mean,
        held.before.p95, held.after.p95, held.before.max, held.after.max));
  }
  if (held.gain.mean > 0.0 && !held.gain.is_beyond_chance()) {
    lines.push_back(
        fmt::format("On these poses the gain is within chance: {:.4f} mm, standard error {:.4f} mm. The names rest on "
                    "the poses searched.",
                    held.gain.mean, held.gain.standard_error));
  }
  lines.push_back(
      held.floor_from_repeats
          ? fmt::format(
                "A perfect model would still miss by {:.4f} mm on average: the noise, measured by repeated poses.",
                held.floor_mm)
          : fmt::format(
                "Too few poses were repeated to measure the noise. The mean distance left at the fitted poses, {:.4f} "
                "mm, was used as the noise.",
                held.floor_mm));
  return lines;
}

// What the reader should do now.
std::string advice(const Discovery& found) {
  using robotics::Headline;
  if (found.answer == discovery::Answer::nothing_missing) return "";
  if (found.headline == Headline::gross_errors)
    return "Next: check the outliers, measure them again, and repeat the search without them.";
  if (found.withdrawn) return "Next: measure more poses. The description that is written is the calibrated one.";
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

std::string discovery_page(const Discovery& found, const std::vector<Eigen::Index>& lines_of_file, std::size_t width,
                           const Face& face) {
  constexpr std::size_t indent = 4;
  std::vector<std::string> lines;
  const auto add = [&](const std::string& text) {
    std::istringstream paragraph(wrapped(text, std::min(width, most_columns), indent));
    for (std::string line; std::getline(paragraph, line);) lines.push_back(line);
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
    std::vector<Eigen::Index> outliers;
    for (const Eigen::Index row : found.outliers) outliers.push_back(lines_of_file[row]);
    constexpr std::size_t shown = 20;
    const std::size_t more = outliers.size() > shown ? outliers.size() - shown : 0;
    outliers.resize(outliers.size() - more);
    add(fmt::format("Outliers, left out: {}{}", face.rows(outliers),
                    more > 0 ? fmt::format(" and {} more", more) : ""));
  }
  if (!found.still.empty()) add(still_text(found.still));
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
