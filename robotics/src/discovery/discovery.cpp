#include "llmt/robotics/discovery/discovery.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "calibration/joint_map_shift.hpp"
#include "discovery/could_state.hpp"
#include "discovery/described.hpp"
#include "discovery/input_mistakes.hpp"
#include "discovery/investigation/pose_split.hpp"
#include "discovery/judges/decision.hpp"
#include "discovery/judges/findings.hpp"
#include "discovery/judges/judges.hpp"
#include "discovery/refits.hpp"
#include "discovery/searched_poses.hpp"
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

// Standard deviation of one coordinate that the search of the residuals leaves, or the search before.
double noise_of(const Findings& found) {
  const std::optional<ResidualSearch>& residual = found.residual_search;
  const bool has_names = residual && residual->verdict.answer != discovery::Answer::unknown;
  return has_names ? residual->verdict.noise : found.investigation.verdict.noise;
}

// A discovery of robots and errors alone. `judging`: the search that the poses set aside took no part in.
Discovery of_robots(Robots robots, const Searched& answer, const Searched& judging, bool is_withdrawn,
                    double noise_mm) {
  const Robots judged = is_withdrawn ? withdrawn(judging.robots) : judging.robots;
  remember_held_out_errors(judging.split, judged.improved, robots.improved);
  Discovery result;
  result.held_out = verify(judged, judging.split, answer.lack_of_fit, noise_mm);
  const Measurements kept = without_rows(answer.split.samples, answer.found.investigation.verdict.outliers);
  result.fitted_before = figures({robots.before, {}}, kept);
  result.fitted_after = figures(robots.improved, kept);
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
  const Findings other = search_effects(calibrated(robot, plain, of_arm, work), of_arm);
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
  options.seed = 1;  // that of `given` deals the poses set aside, and nothing else
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
