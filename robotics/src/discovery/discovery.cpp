#include "llmt/robotics/discovery/discovery.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <stdexcept>
#include <utility>

#include "calibration/joint_map_shift.hpp"
#include "calibration/still_joints.hpp"
#include "calibration/travel.hpp"
#include "discovery/could_state.hpp"
#include "discovery/described.hpp"
#include "discovery/gap_map.hpp"
#include "discovery/input_mistakes.hpp"
#include "discovery/investigation/constant_fit.hpp"
#include "discovery/investigation/investigation.hpp"
#include "discovery/investigation/pose_split.hpp"
#include "discovery/investigation/unsound_effects.hpp"
#include "discovery/judges/decision.hpp"
#include "discovery/judges/findings.hpp"
#include "discovery/judges/judges.hpp"
#include "discovery/judges/wave_harmonics.hpp"
#include "discovery/refits.hpp"
#include "discovery/verification.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

using Notes = std::vector<std::string>;

void add(const Notes& more, Notes& notes) { notes.insert(notes.end(), more.begin(), more.end()); }

// Gives all orientations the same lever, because the search takes all readings to be equally exact.
Measurements with_lever(Measurements measurements, double lever_mm) {
  for (const Eigen::Index row : orientation_rows(measurements.poses)) {
    Observation& seen = measurements.poses.observations[row];
    measurements.positions_mm.row(row) *= lever_mm / seen.lever_mm;
    seen.lever_mm = lever_mm;
  }
  return measurements;
}

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

// Searches for effects. Joint maps are tried where something has no name: after a verdict "unknown", and after waves
// that are no sines. The names are then those beside the maps.
Findings search(Investigation start, const DiscoveryOptions& options) {
  Findings found;
  found.investigation = search_in_rounds(std::move(start), options);
  found.verdict = found.investigation.verdict.answer;
  found.unknown = found_patterns(found.investigation.asked.hypotheses, found.investigation.verdict);
  if (options.maps && found.verdict == discovery::Answer::unknown) add_maps(options, found);
  add_names(options, found);
  if (!is_named(found.verdict)) return found;
  found.harmonics = judge_waves(found, unopposed(judge_names(found, options), found.names.size()));
  if (!found.harmonics) return found;
  add(std::exchange(found.harmonics->notes, {}), found.notes);
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

// Standard deviation of one coordinate that the search of the residuals leaves, or the search before.
double noise_of(const Findings& found) {
  const std::optional<ResidualSearch>& residual = found.residual_search;
  const bool has_names = residual && residual->verdict.answer != discovery::Answer::unknown;
  return has_names ? residual->verdict.noise : found.investigation.verdict.noise;
}

// Repeats that scatter less than the rest do not show all of the noise, whatever the file says. Effects must then
// hold without counting them as independent measurements.
bool repeats_hide_noise(const Findings& found, const std::vector<Objection>& objections) {
  constexpr double significant = 0.05;
  const discovery::LackOfFit& repeats = found.investigation.verdict.lack_of_fit;
  return !is_all_clear(found, objections) && repeats.has_enough_repeats() && repeats.p_value < significant;
}

// What the search of some poses gives: all of them, or those that were not set aside.
struct Searched {
  PoseSplit split;
  Unmapped plain;
  Findings found;
  std::vector<Objection> objections;
  Robots robots;
  discovery::LackOfFit lack_of_fit;
  bool once_each = false;  // repeats of a pose were averaged
  bool is_exact = false;   // the calibrated model leaves nothing; there are no findings
};

// A discovery of robots and errors alone. `judging`: the search that the poses set aside took no part in.
Discovery of_robots(Robots robots, const Searched& answer, const Searched& judging, bool is_withdrawn,
                    double noise_mm) {
  const Robots judged = is_withdrawn ? withdrawn(judging.robots) : judging.robots;
  remember_held_out_errors(judging.split, judged.improved, robots.improved);
  Discovery result;
  result.held_out = verify(judged, judging.split, answer.lack_of_fit, noise_mm);
  result.fitted_before = figures({robots.before, {}}, answer.split.searched);
  result.fitted_after = figures(robots.improved, answer.split.searched);
  result.before = std::move(robots.before);
  result.improved = std::move(robots.improved);
  result.maps = std::move(robots.maps);
  return result;
}

// No name without a model.
void forget_names(Findings& found, std::vector<Objection>& objections) {
  found.names.clear();
  for (Objection& one : objections) one.names.clear();
  objections.push_back({Reason::worse_fit});
}

Discovery without_gap(const Robot& robot, Searched answer, const DiscoveryOptions& options) {
  answer.robots = withdrawn({calibrate(robot, answer.split.samples, options.calibration).robot, {}, {}, {}});
  Discovery result = of_robots(answer.robots, answer, answer, false, 0.0);
  result.notes.emplace_back(
      "The calibrated model reproduces the measurements to rounding: there is no gap to explain.");
  if (const auto note = far_poses_note(answer.robots, answer.split)) result.notes.push_back(*note);
  return result;
}

// An instrument's error has the image of one of the arm where this, searched for alone, explains the poses set aside as
// well.
std::optional<Objection> judge_instrument(const Robot& robot, const Searched& judging, const Findings& found,
                                          const DiscoveryOptions& options, Work& work) {
  const PoseSplit& split = judging.split;
  const Unmapped& plain = judging.plain;
  const auto is_of_instrument = [](const Name& name) { return nature_of(name.effect.effect) == Nature::instrument; };
  if (std::ranges::none_of(found.names, is_of_instrument) || split.test.count() < 3) return {};
  DiscoveryOptions of_arm = options;
  std::erase_if(of_arm.catalogue, [](const EffectType& type) { return type.nature == Nature::instrument; });
  const Findings other = search(calibrated(robot, plain, of_arm, work), of_arm);
  const Robots others = fit_robots(robot, split.samples, plain.maps, other, of_arm);
  if (others.is_worse || other.names.empty()) return {};
  const auto errors = [&](const Robots& of) { return distances(positions(of.improved, split.test.poses), split.test); };
  const Robots& robots = judging.robots;
  if (paired_difference(errors(others), errors(robots)).is_beyond_chance()) return {};
  Objection objection{Reason::arm_instead};
  for (std::size_t k = 0; k < found.names.size(); ++k) {
    if (is_of_instrument(found.names[k])) objection.names.push_back(k);
  }
  std::vector<std::string> labels;
  for (const Name& name : other.names) labels.push_back(effect_label(name.effect.effect));
  objection.notes.push_back(
      fmt::format("Errors of the arm alone ({}) explain the poses set aside as well as those with errors of the "
                  "instrument: {:.4f} and {:.4f} mm. Measure from another place to tell.",
                  fmt::join(labels, ", "), errors(others).mean(), errors(robots).mean()));
  return objection;
}

// Searches the poses that `split_with` does not set aside.
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
  answer.found = search(std::move(start), options);
  answer.objections = judge(answer.found, options);
  answer.lack_of_fit = answer.found.investigation.verdict.lack_of_fit;
  answer.once_each = repeats_hide_noise(answer.found, answer.objections);
  const auto search_again = [&](const DiscoveryOptions& with) {
    answer.found = search(calibrated(robot, answer.plain, with, work), with);
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

// The stages, in the order in which they need each other:
//
// - calibrate: an error that rigid geometry can imitate is no evidence for an effect;
// - search: names, patterns and joint maps. It is repeated with averaged poses if a judge of the repeats asks for it;
// - judge: all judges see the same findings, and raise objections without changing them;
// - fit: both robots are fitted to the poses searched, for the last judge and for the user;
// - verify: all of this is done again without the poses set aside, which are the last judge;
// - describe: the table of decide() makes an answer of verdict and objections, once.
//
// Names, values and the robot that is written are those of all poses: which poses are set aside changes the error that
// is stated, not the answer.
Discovery discover_readings(const Robot& robot, const Measurements& measurements,
                            const std::optional<Measurements>& test, const DiscoveryOptions& given, Work& work) {
  DiscoveryOptions options = given;
  options.seed = 1;
  const auto answer_without = [&](double share) {
    const auto split_with = [&](Repeats repeats) { return set_aside(measurements, test, share, given.seed, repeats); };
    return searched_poses(robot, split_with, options, work);
  };
  Searched answer = answer_without(0.0);
  const std::optional<Searched> without =
      test || given.held_out_share == 0.0 ? std::nullopt : std::optional(answer_without(given.held_out_share));
  const Searched& judging = without ? *without : answer;
  if (answer.is_exact || judging.is_exact) return without_gap(robot, judging, options);
  const PoseSplit& split = judging.split;
  Findings& found = answer.found;
  std::vector<Objection>& objections = answer.objections;
  Notes notes = found.notes;
  for (const Objection& one : objections) add(one.notes, notes);
  add(input_mistakes(answer.plain.robot, found.investigation, unmapped(robot, split.test).measurements,
                     is_all_clear(found, objections)),
      notes);
  add(answer.robots.notes, notes);
  if (answer.once_each) notes.emplace_back("Repeats of a pose scatter less than the rest: each pose was counted once.");
  if (const auto note = far_poses_note(judging.robots, split)) notes.push_back(*note);
  const bool is_worse = answer.robots.is_worse;
  if (is_worse) forget_names(found, objections);
  const std::optional<PairedDifference> gain = held_out_gain(judging.robots, split);
  const Refits refits = is_worse ? Refits{} : refits_of(answer.robots, answer.split, found, options);
  if (const std::optional<Objection> fails = judge_refits(refits)) objections.push_back(*fails);
  if (const std::optional<Objection> arm = judge_instrument(robot, judging, found, options, work)) {
    objections.push_back(*arm);
    add(arm->notes, notes);
  }
  const std::optional<Objection> loss = judge_held_out_loss(gain, found.names.size());
  const bool is_withdrawn = is_worse || loss;
  if (loss) {
    objections.push_back(*loss);
    add(loss->notes, notes);
    answer.robots = withdrawn(std::move(answer.robots));
  }
  const double noise_mm = noise_of(found);
  std::vector<std::string> statable =
      is_withdrawn ? Notes{} : could_state(judging.robots, split, judging.found, options);
  Discovery result =
      described(of_robots(answer.robots, answer, judging, is_withdrawn, noise_mm), found, objections, answer.split);
  result.held_out.gain = gain.value_or(PairedDifference{});
  for (std::size_t k = 0; k < std::min(result.effects.size(), refits.names.size()); ++k) {
    result.effects[k].refits = refits.count;
    result.effects[k].held = refits.names[k].held;
    result.effects[k].ranges = refits.names[k].ranges;
  }
  result.could_state = std::move(statable);
  result.withdrawn = is_withdrawn;
  result.lack_of_fit = answer.lack_of_fit;
  result.noise_mm = noise_mm;
  result.notes = std::move(notes);
  return result;
}

}  // namespace

Discovery discover(const Robot& robot, const Measurements& measurements, const std::optional<Measurements>& test,
                   const DiscoveryOptions& options) {
  validate(robot);
  validate(measurements, robot);
  const Robot whole = with_frames(robot, measurements.poses);
  Work work(options.progress);
  const auto finished = [&](const Measurements& readings, const std::optional<Measurements>& test_readings) {
    Discovery result = discover_readings(whole, readings, test_readings, options, work);
    work.finish();
    return result;
  };
  if (orientation_rows(measurements.poses).empty()) return finished(measurements, test);
  const Calibration balance = calibrate(whole, measurements, options.calibration);
  constexpr double longest_mm = 1e5;
  const double lever_mm = std::min(longest_mm, 1e3 * balance.noise_mm / std::max(1e-9, balance.orientation_noise_mrad));
  std::optional<Measurements> balanced_test = test;
  if (test) balanced_test = with_lever(*test, lever_mm);
  return finished(with_lever(measurements, lever_mm), balanced_test);
}

}  // namespace llmt::robotics
