#include "discovery/searched_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "calibration/travel.hpp"
#include "discovery/investigation/constant_fit.hpp"
#include "discovery/judges/decision.hpp"
#include "discovery/judges/judges.hpp"
#include "discovery/judges/wave_harmonics.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

// Throws if calibration leaves too few degrees of freedom for a search.
void check_freedom(const Measurements& samples, const Calibration& baseline) {
  const Eigen::Index axes = std::ranges::count(samples.measured, true);
  const Eigen::Index coordinates = samples.count() * axes;
  const Eigen::Index needed = baseline.result.rank + std::max<Eigen::Index>(10, baseline.result.rank / 2);
  if (coordinates < needed) {
    throw std::runtime_error(fmt::format(
        "{} poses to search give {} coordinates, and calibration takes {} of them: at least {} coordinates, "
        "{} poses, are needed to tell anything",
        samples.count(), coordinates, baseline.result.rank, needed, (needed + axes - 1) / axes));
  }
}

// Throws if the error is larger than any effect makes it: wrong units, order or signs of joints, another robot, too
// many lost beams. The nominal chain is the measure: a tool that was fitted to nonsense may be metres long.
void check_plausible(const Robot& nominal, const Robot& calibrated, const Measurements& samples) {
  const double reach = reach_of(nominal.chain) + travel_of(nominal.chain, samples.poses);
  const double typical = median(distances(positions(calibrated, samples.poses), samples));
  constexpr double implausible = 0.02;
  if (reach > 0.0 && typical > implausible * reach) {
    throw std::runtime_error(fmt::format(
        "the calibrated model misses the measurements by {:.4g} mm, {:.0f} % of the machine's size: no effect "
        "does that. Check "
        "units, order, signs and zeros of the joints, the axes of the instrument, and the description",
        typical, 100.0 * typical / reach));
  }
}

bool is_exact(const Robot& robot, const Measurements& samples) {
  constexpr double rounding = 1e-10;
  const double largest = distances(positions(robot, samples.poses), samples).maxCoeff();
  return largest < rounding * std::max(1.0, samples.positions_mm.cwiseAbs().maxCoeff());
}

// The search with joint maps, if maps help.
void add_maps(const DiscoveryOptions& options, Findings& found) {
  report_progress(*found.investigation.work, "mapping the joints");
  std::optional<JointMaps> maps = helpful_maps(found.investigation);
  if (!maps) {
    found.notes.emplace_back(
        "Free maps of the joints (angle error over angle) would not lower the error on poses left out.");
    return;
  }
  found.notes.push_back(
      fmt::format("Free maps of {} joints (angle error over angle) were added: they lower the error on poses left out.",
                  maps->effects.size()));
  found.maps = maps->effects;
  found.map_fit = std::move(maps);
  found.investigation = search_with_maps(std::move(found.investigation), found.maps, options);
}

// The names of the last search and of its residuals, with their fitted constants.
void add_names(const DiscoveryOptions& options, Findings& found) {
  Investigation& last = found.investigation;
  found.larger = last.found;
  found.residual_search = is_named(last.verdict.answer) ? search_residuals(last, options) : std::nullopt;
  std::vector<Hypothesis>* also = found.residual_search ? &found.residual_search->asked.hypotheses : nullptr;
  const std::map<std::string, double> constant_errors = fit_constants(last, options, also);
  found.names = named_effects(last.asked.hypotheses, last.verdict, last.fitted, options.mass_uncertainty);
  if (found.residual_search) {
    const std::vector<Name> smaller =
        smaller_effects(*found.residual_search, last.verdict, last.fitted, options.mass_uncertainty);
    found.names.insert(found.names.end(), smaller.begin(), smaller.end());
  }
  if (found.map_fit) {
    // The model keeps them, but what they are beside the maps is nobody's cause.
    const std::set<std::string> followed = followed_by_maps(last, *found.map_fit);
    std::erase_if(found.names, [&](const Name& one) { return followed.contains(effect_label(one.effect.effect)); });
  }
  for (Name& name : found.names) {
    const auto error = constant_errors.find(effect_label(name.effect.effect));
    if (error != constant_errors.end()) name.effect.constant_error = error->second;
  }
}

// Repeats that scatter less than the rest do not show all of the noise, whatever the file says. Effects must then
// hold without counting them as independent measurements.
bool repeats_hide_noise(const Findings& found, const std::vector<Objection>& objections) {
  constexpr double significant = 0.05;
  const discovery::LackOfFit& repeats = found.investigation.verdict.lack_of_fit;
  return !is_all_clear(found, objections) && repeats.has_enough_repeats() && repeats.p_value < significant;
}

}  // namespace

Investigation calibrated(const Robot& described, const Unmapped& plain, const DiscoveryOptions& options, Work& work) {
  Investigation start;
  start.work = &work;
  work.begin("calibrating");
  start.searched = plain.measurements;
  RobustCalibration robust = calibrate_robustly(plain.robot, start.searched, options.calibration);
  start.baseline = std::move(robust.calibration);
  start.baseline_without = std::move(robust.left_out);
  check_freedom(start.searched, start.baseline);
  check_plausible(described, start.baseline.robot, start.searched);
  return start;
}

Findings search_effects(Investigation start, const DiscoveryOptions& options) {
  Findings found;
  found.investigation = search_in_rounds(std::move(start), options);
  found.verdict = found.investigation.verdict.answer;
  found.unknown = found_patterns(found.investigation.asked.hypotheses, found.investigation.verdict);
  if (options.maps && found.verdict == discovery::Answer::unknown) add_maps(options, found);
  add_names(options, found);
  if (!is_named(found.verdict)) return found;
  found.harmonics = judge_waves(found, unopposed(judge_names(found, options), found.names.size()));
  if (!found.harmonics) return found;
  const std::vector<std::string> notes = std::exchange(found.harmonics->notes, {});
  found.notes.insert(found.notes.end(), notes.begin(), notes.end());
  if (!options.maps) return found;
  add_maps(options, found);
  if (found.maps.empty()) return found;
  add_names(options, found);
  found.harmonics->names = waves_at(found.harmonics->unknown, found.names);
  return found;
}

bool is_all_clear(const Findings& found, const std::vector<Objection>& objections) {
  return found.verdict == discovery::Answer::nothing_missing && objections.empty();
}

Searched searched_poses(const Robot& robot, const std::function<PoseSplit(Repeats)>& split_with,
                        const DiscoveryOptions& options, Work& work) {
  PoseSplit split = split_with(Repeats::as_marked);
  if (split.samples.count() * std::ranges::count(split.samples.measured, true) < 10) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::discover: {} poses to search are too few", split.samples.count()));
  }
  Unmapped plain = unmapped(robot, split.samples);
  Searched answer{std::move(split), std::move(plain), {}, {}, {}, {}};
  Investigation start = calibrated(robot, answer.plain, options, work);
  answer.is_exact = is_exact(start.baseline.robot, start.searched);
  if (answer.is_exact) return answer;
  answer.found = search_effects(std::move(start), options);
  answer.objections = judge(answer.found, options);
  answer.lack_of_fit = answer.found.investigation.verdict.lack_of_fit;
  answer.once_each = repeats_hide_noise(answer.found, answer.objections);
  const auto search_again = [&](const DiscoveryOptions& with) {
    answer.found = search_effects(calibrated(robot, answer.plain, with, work), with);
    answer.objections = judge(answer.found, with);
  };
  if (answer.once_each) {
    answer.split = split_with(Repeats::averaged);
    answer.plain = unmapped(robot, answer.split.samples);
    search_again(options);
  }
  answer.robots = fit_robots(robot, answer.split.samples, answer.plain.maps, answer.found, options);
  if (answer.robots.is_worse && !answer.found.maps.empty()) {
    // What was found before the maps may stand without them.
    DiscoveryOptions without_maps = options;
    without_maps.maps = false;
    search_again(without_maps);
    answer.robots = fit_robots(robot, answer.split.samples, answer.plain.maps, answer.found, without_maps);
    answer.found.notes.emplace_back(
        "Free maps of the joints were tried and taken back: the refit with them did not converge to anything better.");
  }
  return answer;
}

}  // namespace llmt::robotics
