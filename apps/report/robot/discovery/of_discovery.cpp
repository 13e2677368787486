#include "report/robot/discovery/of_discovery.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "report/document/figures.hpp"
#include "report/robot/arms.hpp"
#include "report/robot/discovery/discovery_tables.hpp"
#include "report/robot/discovery/effect_text.hpp"
#include "report/robot/provenance.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

using robotics::Discovery;
using robotics::FoundEffect;

constexpr std::size_t most_charts = 4;

// The confirmed effects, those of one kind together: "link bending (joint1, joint2)".
std::vector<std::string> names_of(const Discovery& found, bool confirmed) {
  std::vector<std::pair<std::string, std::vector<std::string>>> kinds;
  for (const FoundEffect& effect : found.effects) {
    if (effect.confirmed != confirmed) continue;
    const std::string kind = effect.title + constants_of(effect);
    const auto same = std::ranges::find(kinds, kind, &std::pair<std::string, std::vector<std::string>>::first);
    if (same == kinds.end()) {
      kinds.push_back({kind, {place_of(effect)}});
    } else {
      same->second.push_back(place_of(effect));
    }
  }
  std::vector<std::string> names;
  for (const auto& [kind, places] : kinds) names.push_back(fmt::format("{} ({})", kind, fmt::join(places, ", ")));
  return names;
}

std::string cause(const Discovery& found) {
  if (found.headline == robotics::Headline::likely_causes ||
      found.headline == robotics::Headline::likely_causes_unwritten)
    return fmt::format("Likely causes, none certain: {}", fmt::join(names_of(found, false), "; "));
  const std::vector<std::string> names = names_of(found, true);
  switch (found.answer) {
    case discovery::Answer::nothing_missing:
      return "Nothing is missing that these poses could show";
    case discovery::Answer::named:
      return fmt::format("The model lacks: {}", fmt::join(names, "; "));
    case discovery::Answer::indistinguishable:
      return fmt::format("The model lacks: {}; or something that looks alike at these poses", fmt::join(names, "; "));
    case discovery::Answer::unknown:
    case discovery::Answer::undecided:        // of no robot, as the next
    case discovery::Answer::failed_held_out:  // of no robot
    case discovery::Answer::parameters_only:
    case discovery::Answer::inner_state:
      break;
  }
  std::set<std::string> places;
  for (const robotics::FoundPattern& one : found.unknown) places.insert(one.pattern.acts_on);
  return fmt::format("Something is missing that no known effect explains{}{}", places.empty() ? "" : "; it acts on ",
                     fmt::join(places, ", "));
}

struct Gap {
  robotics::ErrorFigures before;
  robotics::ErrorFigures after;
  std::string on;
};

Gap gap_of(const Discovery& found) {
  if (found.held_out.poses == 0) return {found.fitted_before, found.fitted_after, "the poses that were searched"};
  const robotics::HeldOut& held = found.held_out;
  return {held.before, held.after,
          fmt::format("{} poses, {}", held.poses,
                      held.rows.empty() ? "that took no part" : "of what was found without them")};
}

Chart gap_chart(const Discovery& found) {
  const Gap gap = gap_of(found);
  const auto label = [](double value) { return fmt::format("{} mm", number(value, 3)); };
  Chart chart = ranking("The gap, before and after", "mean position error, mm",
                        {"calibrated geometry", "with what was found", "noise alone"},
                        {gap.before.mean, gap.after.mean, found.held_out.floor_mm},
                        {label(gap.before.mean), label(gap.after.mean), label(found.held_out.floor_mm)});
  chart.layers.front().roles = {"before", "after", "floor"};
  chart.caption =
      fmt::format("On {}. 95 % of them: {} before, {} mm after. Noise: {}.", gap.on, number(gap.before.p95, 3),
                  number(gap.after.p95, 3),
                  found.held_out.floor_from_repeats ? "from repeated poses"
                                                    : "the error left over, since too few poses were repeated");
  return chart;
}

// What the model lacked along the motion of a joint, and what was added, over the joint's value.
Chart shape_chart(const Discovered& of, Eigen::Index joint, const std::string& title) {
  constexpr Eigen::Index most_shown = 1500;
  const robotics::Robot& before = of.found.before;
  const Eigen::MatrixXd model = robotics::positions(before, of.measurements.poses);
  const Eigen::VectorXd lacked = along_joint(before, of.measurements, errors_at(model, of.measurements), joint);
  robotics::Measurements improved = of.measurements;
  improved.positions_mm = robotics::positions(of.found.improved, of.measurements.poses);
  const Eigen::VectorXd added = along_joint(before, of.measurements, errors_at(model, improved), joint);
  const Numbers values = joint_values(before.chain, of.measurements.poses.joints, joint);
  Layer data{.name = "measured - model before", .role = "before", .size = 8};
  Layer effect{.name = "what was added", .role = "after", .size = 4};
  for (const Eigen::Index row : thinned(of.measurements.count(), most_shown)) {
    data.x.push_back(values[row]);
    data.y.push_back(lacked(row));
    effect.x.push_back(values[row]);
    effect.y.push_back(added(row));
  }
  return {.title = title,
          .caption =
              fmt::format("The part of each error along the motion of {}, over that joint: the effect should lie in "
                          "the middle of the data.{}",
                          before.chain.joints[joint].name, thinning_note(of.measurements.count(), "poses", most_shown)),
          .x = {joint_axis(before.chain, joint)},
          .y = {"along the joint's motion, mm"},
          .layers = {data, effect}};
}

// Joints that what was found acts on, each once, with a title.
std::vector<std::pair<Eigen::Index, std::string>> places_of(const Discovery& found) {
  std::vector<std::pair<Eigen::Index, std::string>> places;
  const auto add = [&](const std::string& at, const std::string& title) {
    const auto& joints = found.before.chain.joints;
    const auto place = std::ranges::find(joints, at, &robotics::Joint::name);
    if (place == joints.end()) return;
    const Eigen::Index joint = place - joints.begin();
    if (std::ranges::find(places, joint, &std::pair<Eigen::Index, std::string>::first) == places.end())
      places.emplace_back(joint, title);
  };
  for (const FoundEffect& effect : found.effects) {
    if (effect.confirmed) add(effect.effect.at, "The effect: " + title_of(effect));
  }
  for (const robotics::FoundPattern& one : found.unknown)
    add(one.pattern.acts_on, fmt::format("The unknown effect on {}", one.pattern.acts_on));
  for (const robotics::Effect& map : found.maps) add(map.at, fmt::format("The free map of {}", map.at));
  return places;
}

// The error when the geometry is fitted with the named effect, and with each rival in its place.
std::optional<Chart> rivals_chart(const Discovered& of, const FoundEffect& named) {
  constexpr std::size_t most_rivals = 8;
  if (named.rival_effects.empty()) return {};
  std::vector<std::string> names;
  Numbers errors;
  std::vector<std::string> labels;
  const auto add = [&](const std::string& name, const std::vector<robotics::Effect>& effects) {
    robotics::Robot robot = of.found.before;
    robot.effects.insert(robot.effects.end(), effects.begin(), effects.end());
    const robotics::Calibration fitted = robotics::calibrate(robot, of.measurements, {.start_as_given = true});
    errors.push_back(
        robotics::distances(robotics::positions(fitted.robot, of.measurements.poses), of.measurements).mean());
    names.push_back(name);
    labels.push_back(fmt::format("{} mm", number(errors.back(), 4)));
  };
  add("geometry alone", {});
  robotics::Effect start = named.effect;
  add(robotics::effect_label(named.effect), {start});
  for (std::size_t k = 0; k < std::min(named.rival_effects.size(), most_rivals); ++k)
    add(rival_words(named, k), named.rival_effects[k]);
  Chart chart = ranking("The name and its rivals", "mean position error, mm", names, errors, labels, "muted");
  chart.layers.front().roles = std::vector<std::string>(names.size(), "muted");
  chart.layers.front().roles[0] = "before";
  chart.layers.front().roles[1] = "after";
  chart.caption =
      "Geometry fitted anew with each explanation alone. Bars of one length cannot be told apart by these poses.";
  return chart;
}

Json shares(const std::string& title, const std::string& caption, const std::vector<robotics::GapMap::Share>& from) {
  std::vector<std::string> names;
  Numbers values;
  std::vector<std::string> labels;
  for (const robotics::GapMap::Share& share : from) {
    names.push_back(share.name);
    values.push_back(100.0 * share.share);
    labels.push_back(fmt::format("{:.0f} %", 100.0 * share.share));
  }
  Chart chart = ranking(title, "%", names, values, labels, "before");
  chart.caption = caption;
  return block(chart);
}

Section where(const Discovered& of) {
  const Discovery& found = of.found;
  Section section{"Where model and robot disagreed"};
  const Eigen::MatrixXd before = errors_at(robotics::positions(found.before, of.measurements.poses), of.measurements);
  const Eigen::MatrixXd after = errors_at(robotics::positions(found.improved, of.measurements.poses), of.measurements);
  const double scale = arrow_scale(before, of.measurements);
  section.blocks = {
      block(arm_picture("Before: geometry calibrated", found.before, of.measurements, before, scale, "before")),
      block(arm_picture("After: with what was found", found.improved.robot, of.measurements, after, scale, "after"))};
  if (found.answer == discovery::Answer::nothing_missing) section.blocks.resize(1);
  if (!found.gap.regions.empty()) {
    std::vector<std::string> names;
    Numbers values;
    std::vector<std::string> labels;
    for (const robotics::GapMap::Region& region : found.gap.regions) {
      names.push_back(region.conditions);
      values.push_back(region.mean_mm);
      labels.push_back(fmt::format("{} mm in {} poses", number(region.mean_mm, 3), region.poses));
    }
    Chart chart = ranking("By region", "mean error before, mm", names, values, labels, "before");
    chart.wide = true;
    section.blocks.push_back(block(chart));
  }
  if (!found.gap.acts_like.empty())
    section.blocks.push_back(shares("Which joint's motion it resembles",
                                    "Share of the squared error along the motion by each joint. Directions overlap, so "
                                    "the shares do not add up to 100 %; a third is chance.",
                                    found.gap.acts_like));
  if (!found.gap.depends_on.empty())
    section.blocks.push_back(
        shares("What it depends on", "Share of each input in a tree of the errors.", found.gap.depends_on));
  return section;
}

}  // namespace

Document discovery_report(const Discovered& of) {
  const Discovery& found = of.found;
  const Gap gap = gap_of(found);
  Document document{.title = fmt::format("llmt-robot discover {} {}", file_name(of.robot), file_name(of.data)),
                    .answer = cause(found)};
  const std::string fall =
      fmt::format("the error from {} to {} mm", number(gap.before.mean, 3), number(gap.after.mean, 3));
  switch (found.answer) {
    case discovery::Answer::nothing_missing:
      document.answer += fmt::format(": the error is {} mm, noise alone makes {} mm.", number(gap.before.mean, 3),
                                     number(found.held_out.floor_mm, 3));
      break;
    case discovery::Answer::failed_held_out:
    case discovery::Answer::unknown:
      if (found.withdrawn) {
        document.answer += ". Nothing was added, because it would not make these poses better.";
        break;
      }
      document.answer += fmt::format(
          ". {} {}.",
          found.headline == robotics::Headline::likely_causes ? "Adding these takes" : "Free maps in its place take",
          fall);
      break;
    default:
      document.answer += fmt::format(". Adding this takes {}.", fall);
  }
  document.lead = fmt::format(
      "{} poses; mean errors on {}. {} hypotheses were compared; the evidence is {:.0f}, and chance alone reaches "
      "{:.0f}.",
      of.measurements.count(), gap.on, found.hypotheses, found.score_gain, found.threshold);
  if (found.answer == discovery::Answer::unknown)
    document.lead += " Effects marked as perhaps are guesses: do not order parts by them.";
  document.main = gap_chart(found);
  std::vector<Json> patterns;
  for (const auto& [joint, title] : places_of(found)) {
    if (patterns.size() < most_charts) patterns.push_back(block(shape_chart(of, joint, title)));
  }
  if (!patterns.empty()) {
    document.beside_main = {patterns.front()};
    patterns.erase(patterns.begin());
  } else {
    document.beside_main = {block(coverage(found.before.chain, of.measurements.poses.joints))};
  }
  Section what{"What was found"};
  if (!found.effects.empty() || !found.unknown.empty()) what.blocks.push_back(effects_table(found));
  for (Json& pattern : patterns) what.blocks.push_back(std::move(pattern));
  for (const FoundEffect& effect : found.effects) {
    if (!effect.confirmed) continue;
    if (const auto chart = rivals_chart(of, effect)) what.blocks.push_back(block(*chart));
  }
  if (!found.notes.empty()) what.blocks.push_back(text_block("Notes", found.notes));
  document.sections.push_back(std::move(what));
  document.sections.push_back(where(of));
  Section next{"What to measure next"};
  for (const NextPoses& each : of.next) next.blocks.push_back(next_table(found.before.chain, each));
  if (found.answer != discovery::Answer::nothing_missing) {
    Map map = coverage(found.before.chain, of.measurements.poses.joints);
    map.wide = true;
    next.blocks.push_back(block(map));
  }
  document.sections.push_back(std::move(next));
  Section limits{"What this cannot say"};
  if (found.answer == discovery::Answer::nothing_missing && !found.visible.empty())
    limits.blocks.push_back(visible_table(found));
  if (!found.not_testable.empty()) limits.blocks.push_back(untestable_table(found));
  document.sections.push_back(std::move(limits));
  for (Section& section : provenance_section(found.improved.robot)) document.sections.push_back(std::move(section));
  return document;
}

}  // namespace llmt::report
