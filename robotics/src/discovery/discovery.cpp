#include "llmt/robotics/discovery.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "calibration/joint_map_shift.hpp"
#include "discovery/doubts.hpp"
#include "discovery/findings.hpp"
#include "discovery/gap_map.hpp"
#include "discovery/investigation.hpp"
#include "discovery/noise_tests.hpp"
#include "discovery/overtones.hpp"
#include "discovery/pose_split.hpp"
#include "discovery/refined_constants.hpp"
#include "discovery/rest_correction.hpp"
#include "discovery/second_look.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

ErrorFigures figures(const CorrectedRobot& robot, const Measurements& measurements) {
  const Eigen::VectorXd errors = distances(positions(robot, measurements.poses), measurements);
  return error_figures(errors(position_rows(measurements.poses)));
}

Eigen::Index count_of_stands(const Poses& poses) {
  if (poses.observations.empty()) return poses.count();
  std::set<Eigen::Index> stands;
  for (const Observation& seen : poses.observations) stands.insert(seen.stand);
  return std::ssize(stands);
}

// The search takes all readings for equally exact. With this lever orientations are.
Measurements with_lever(Measurements measurements, double lever_mm) {
  for (const Eigen::Index row : orientation_rows(measurements.poses)) {
    Observation& seen = measurements.poses.observations[row];
    measurements.positions_mm.row(row) *= lever_mm / seen.lever_mm;
    seen.lever_mm = lever_mm;
  }
  return measurements;
}

// Mean length of a vector of d independent normal components.
double mean_distance(double sigma, Eigen::Index components) {
  const auto d = static_cast<double>(components);
  return sigma * std::sqrt(2.0) * std::exp(std::lgamma(0.5 * (d + 1.0)) - std::lgamma(0.5 * d));
}

// Reports poses set aside that are far off, such as lost beams. They are not removed: no choice depends on these poses.
void report_far_poses(const CorrectedRobot& improved, const Measurements& test, Discovery& result) {
  const Eigen::VectorXd errors = distances(positions(improved, test.poses), test);
  const double typical = median(errors);
  constexpr double far = 10.0;
  const auto count = (errors.array() > far * typical).count();
  if (count > 0 && typical > 0.0) {
    result.notes.push_back(
        fmt::format("{} of the {} poses set aside are more than ten times as far off as the median ({:.4f} mm): lost "
                    "beams, or poses unlike the others.",
                    count, errors.size(), typical));
  }
}

// Names that make the poses set aside worse, by more than two standard errors, are not written.
void withdraw_what_is_worse(const Measurements& searched, const Measurements& test, Discovery& result) {
  if (test.count() < 3 || result.effects.empty()) return;
  Measurements common = test;
  for (std::size_t axis = 0; axis < 3; ++axis) common.measured[axis] = test.measured[axis] && searched.measured[axis];
  const PairedDifference loss = paired_difference(distances(positions(result.improved, common.poses), common),
                                                  distances(positions(result.before, common.poses), common));
  if (!loss.is_beyond_chance()) return;
  result.notes.push_back(
      fmt::format("What was found makes the poses set aside worse, {:.4f} mm instead of {:.4f}: the "
                  "description is as calibrated, and the names are guesses.",
                  result.held_out.after.mean, result.held_out.before.mean));
  result.answer = discovery::Answer::unknown;
  for (FoundEffect& effect : result.effects) effect.confirmed = false;
  result.improved = {result.before, {}};
  result.maps.clear();
  result.fitted_after = result.fitted_before;
  result.held_out.after = result.held_out.before;
}

// For a later check of the robot.
void remember_error(const Measurements& searched, const Measurements& test, Discovery& result) {
  std::optional<CalibrationRecord>& record = result.improved.robot.calibration;
  if (test.count() < 2 || !record || test.measured != searched.measured) return;
  const Eigen::VectorXd all = distances(positions(result.improved, test.poses), test);
  remember_errors(*record, all(position_rows(test.poses)));
}

void verify(const Measurements& searched, const Measurements& test, Eigen::Index components, Discovery& result) {
  result.fitted_before = figures({result.before, {}}, searched);
  result.fitted_after = figures(result.improved, searched);
  if (test.count() > 0) {
    // Only along axes that were fitted: the others were never measured.
    Measurements common = test;
    for (std::size_t axis = 0; axis < 3; ++axis) common.measured[axis] = test.measured[axis] && searched.measured[axis];
    if (std::ranges::none_of(common.measured, [](bool seen) { return seen; })) {
      throw std::runtime_error("the test measurements share no coordinate with those that were searched");
    }
    result.held_out.before = figures({result.before, {}}, common);
    result.held_out.after = figures(result.improved, common);
    result.held_out.poses = count_of_stands(test.poses);
    report_far_poses(result.improved, common, result);
  }
  withdraw_what_is_worse(searched, test, result);
  remember_error(searched, test, result);
  result.held_out.floor_from_repeats = result.lack_of_fit.has_enough_repeats();
  const double noise_mm = result.held_out.floor_from_repeats ? result.lack_of_fit.noise : result.noise_mm;
  result.held_out.floor_mm = mean_distance(noise_mm, components);
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
  const double reach = reach_of(nominal.chain);
  const double typical = median(distances(positions(calibrated, samples.poses), samples));
  constexpr double implausible = 0.02;
  if (reach > 0.0 && typical > implausible * reach) {
    throw std::runtime_error(
        fmt::format("the calibrated model misses the measurements by {:.4g} mm, {:.0f} % of the arm's reach: no effect "
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

bool is_named(discovery::Answer answer) {
  return answer == discovery::Answer::named || answer == discovery::Answer::indistinguishable;
}

// Beside what has a name, too, the rest should be noise. Where the instrument's errors are left, an effect of the arm
// may be their image.
void describe_rest(const Investigation& investigation, const DiscoveryOptions& options, Discovery& result) {
  if (!is_named(result.answer) || !result.more.empty()) return;
  std::vector<std::size_t> skipped = investigation.verdict.outliers;
  std::ranges::sort(skipped);
  const std::optional<NoNoise> fault = no_noise(investigation.fitted, investigation.searched, skipped, options.seed);
  if (!fault) return;
  result.notes.push_back(fmt::format("What was found is not all: {}.", fault->reason));
  if (fault->where != "instrument") return;
  for (FoundEffect& effect : result.effects) {
    effect.confirmed = effect.confirmed && effect.effect.type.starts_with("instrument_");
  }
  if (std::ranges::any_of(result.effects, &FoundEffect::confirmed)) return;
  result.answer = discovery::Answer::unknown;
  result.unknown.push_back({{fault->where, {}, std::nullopt, "noise"}, 1.0});
}

// "Nothing missing" needs residuals that an instrument's noise can be, and few measurements that fit nothing.
void refuse_all_clear(const Investigation& investigation, const DiscoveryOptions& options, Discovery& result) {
  if (result.answer != discovery::Answer::nothing_missing) return;
  const Measurements& searched = investigation.searched;
  std::vector<std::size_t> skipped = investigation.verdict.outliers;
  std::ranges::sort(skipped);
  const Measurements kept = without_rows(searched, skipped);
  const double tail = tail_of(distances(positions(investigation.fitted.robot, kept.poses), kept),
                              std::ranges::count(searched.measured, true));
  constexpr double heaviest = 1.6;  // Student's t with 4 degrees of freedom: 1.2
  const auto most =
      static_cast<Eigen::Index>(options.search.largest_outlier_share * static_cast<double>(searched.count()));
  if (std::ssize(skipped) >= std::max<Eigen::Index>(most, 3) || tail > heaviest) {
    result.answer = discovery::Answer::unknown;
    result.unknown.push_back({{"measurements", {}, std::nullopt, "outliers"}, 1.0});
    result.notes.push_back(fmt::format(
        "More measurements fit nothing than can be told from an effect ({} were left out, at most {} are): check them "
        "before anything else.",
        skipped.size(), most));
    return;
  }
  if (const std::optional<NoNoise> fault = no_noise(investigation.fitted, searched, skipped, options.seed)) {
    result.answer = discovery::Answer::unknown;
    result.unknown.push_back({{fault->where, {}, std::nullopt, "noise"}, 1.0});
    result.notes.push_back(fmt::format("No candidate explains it, but {}.", fault->reason));
  }
}

// Names, sizes and limits of what the search found.
void describe_search(const Robot& robot, Investigation& investigation, const DiscoveryOptions& options,
                     Discovery& result) {
  const discovery::Verdict& verdict = investigation.verdict;
  std::optional<SecondLook> look;
  const std::vector<Hypothesis> large = investigation.found;
  if (is_named(verdict.answer)) look = look_again(investigation, options);
  const std::map<std::string, double> constant_errors =
      refine_constants(investigation, options, look ? &look->asked.hypotheses : nullptr);
  describe_effects(investigation.asked.hypotheses, verdict, investigation.fitted, options.mass_uncertainty, result);
  describe_limits(investigation.asked.hypotheses, investigation.asked.untestable, verdict, robot, result);
  describe_refused(investigation, robot, result);
  if (look) describe_smaller(*look, large, verdict, investigation.fitted, options, result);
  for (FoundEffect& effect : result.effects) {
    const auto error = constant_errors.find(effect_label(effect.effect));
    if (error != constant_errors.end()) effect.constant_error = error->second;
  }
}

// A wave that is no sine makes the answer unknown after the search. As for any unknown effect, maps of the joints are
// tried then. Waves of the doubted joints stay guesses.
void map_doubted_waves(const Robot& robot, Investigation& investigation, const DiscoveryOptions& options,
                       Discovery& result) {
  Discovery mapped;
  mapped.answer = result.answer;
  mapped.unknown = result.unknown;
  mapped.notes = result.notes;
  add_maps(investigation, options, mapped);
  if (mapped.maps.empty()) {
    result.notes = std::move(mapped.notes);
    return;
  }
  describe_search(robot, investigation, options, mapped);
  for (FoundEffect& effect : mapped.effects) {
    const bool is_doubted = std::ranges::any_of(
        mapped.unknown, [&](const FoundShape& found) { return found.shape.acts_on == effect.effect.at; });
    if (effect.effect.type == "transmission_error" && is_doubted) effect.confirmed = false;
  }
  result = std::move(mapped);
}

Discovery discover_in(const Robot& robot, const PoseSplit& split, const DiscoveryOptions& options, Work& work) {
  // Joint maps that the robot has already are applied to the joint values, and the search is made without them.
  const Unmapped plain = unmapped(robot, split.samples);
  Discovery result;
  Investigation investigation;
  investigation.work = &work;
  work.begin("calibrating");
  investigation.searched = plain.measurements;
  RobustCalibration start = calibrate_robustly(plain.robot, investigation.searched, options.calibration);
  investigation.baseline = std::move(start.calibration);
  investigation.baseline_without = std::move(start.left_out);
  check_freedom(investigation.searched, investigation.baseline);
  check_plausible(robot, investigation.baseline.robot, investigation.searched);
  if (is_exact(investigation.baseline.robot, investigation.searched)) {
    result.before = calibrate(robot, split.samples, options.calibration).robot;
    result.improved.robot = result.before;
    result.notes.emplace_back(
        "The calibrated model reproduces the measurements to rounding: there is no gap to explain.");
    return result;
  }
  investigation.search(options);
  const discovery::Verdict& verdict = investigation.verdict;
  result.answer = verdict.answer;
  describe_shapes(investigation.asked.hypotheses, verdict, result.unknown);
  if (options.maps && verdict.answer == discovery::Answer::unknown) add_maps(investigation, options, result);
  describe_search(robot, investigation, options, result);
  if (is_named(result.answer)) {
    doubt_waves(investigation, result);
    if (options.maps && !is_named(result.answer)) map_doubted_waves(robot, investigation, options, result);
  }
  for (const std::size_t sample : verdict.outliers) {
    for (const Eigen::Index row : split.rows[sample]) result.outliers.push_back(row);
  }
  refuse_all_clear(investigation, options, result);
  describe_rest(investigation, options, result);
  add_doubts(plain.robot, investigation, unmapped(robot, split.test).measurements, result);
  const Measurements kept = without_rows(split.samples, verdict.outliers);
  result.before = calibrate(robot, kept, options.calibration).robot;
  result.rounds = investigation.rounds;
  result.improved.robot = investigation.fitted.robot;
  for (const std::vector<Effect>* maps : {&plain.maps, static_cast<const std::vector<Effect>*>(&result.maps)}) {
    result.improved.robot.effects.insert(result.improved.robot.effects.end(), maps->begin(), maps->end());
  }
  // A refit that ended in a worse minimum is discarded.
  if (total_distance(result.improved.robot, kept) > total_distance(result.before, kept)) {
    result.improved.robot = result.before;
    result.maps.clear();
    result.notes.emplace_back(
        "The refit with what was found did not converge to anything better: the model is as calibrated.");
  }
  if (options.correct && verdict.answer == discovery::Answer::unknown) {
    begin(investigation, "trying a correction");
    correct_rest(kept, options.seed, work, result);
  }
  locate(kept, result);
  return result;
}

Discovery discover_readings(const Robot& robot, const Measurements& measurements,
                            const std::optional<Measurements>& test, const DiscoveryOptions& options) {
  const PoseSplit split = set_aside(measurements, test, options.held_out_share, options.seed, Repeats::as_marked);
  const Eigen::Index components = std::ranges::count(measurements.measured, true);
  if (split.samples.count() * components < 10) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::discover: {} poses to search are too few", split.samples.count()));
  }
  Work work(options.progress);
  Discovery result = discover_in(robot, split, options, work);
  // Repeats that scatter less than the rest do not show all of the noise, whatever the file says. What was found must
  // then hold without counting them as independent measurements.
  constexpr double surprising = 0.05;
  const bool doubtful = result.answer != discovery::Answer::nothing_missing &&
                        result.lack_of_fit.has_enough_repeats() && result.lack_of_fit.p_value < surprising;
  if (doubtful) {
    const discovery::LackOfFit repeats = result.lack_of_fit;
    result = discover_in(robot, set_aside(measurements, test, options.held_out_share, options.seed, Repeats::averaged),
                         options, work);
    result.lack_of_fit = repeats;
    result.notes.emplace_back("Repeats of a pose scatter less than the rest: each pose was counted once.");
  }
  verify(split.searched, split.test, components, result);
  work.finish();
  return result;
}

}  // namespace

Discovery discover(const Robot& robot, const Measurements& measurements, const std::optional<Measurements>& test,
                   const DiscoveryOptions& options) {
  validate(robot);
  validate(measurements, robot);
  const Robot whole = with_frames(robot, measurements.poses);
  if (orientation_rows(measurements.poses).empty()) return discover_readings(whole, measurements, test, options);
  const Calibration balance = calibrate(whole, measurements, options.calibration);
  constexpr double longest_mm = 1e5;
  const double lever_mm = std::min(longest_mm, 1e3 * balance.noise_mm / std::max(1e-9, balance.orientation_noise_mrad));
  std::optional<Measurements> balanced_test = test;
  if (test) balanced_test = with_lever(*test, lever_mm);
  return discover_readings(whole, with_lever(measurements, lever_mm), balanced_test, options);
}

}  // namespace llmt::robotics
