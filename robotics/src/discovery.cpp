#include "llmt/robotics/discovery.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include "discovery_report.hpp"
#include "discovery_steps.hpp"
#include "hypotheses.hpp"
#include "joint_maps.hpp"
#include "llmt/random.hpp"

namespace llmt::robotics {
namespace {

void say(const DiscoveryOptions& options, const std::string& stage) {
  if (options.progress) options.progress(stage);
}

// What the search is to explain at the current estimates: the robot's found effects compete anew, with what they
// explain added back to the residuals.
struct Question {
  discovery::Evidence evidence;
  std::vector<Hypothesis> hypotheses;
  std::vector<Untestable> untestable;
};

Eigen::VectorXd stacked_residuals(const Robot& robot, const Measurements& measurements) {
  const Eigen::MatrixXd model = positions(robot, measurements.poses);
  Eigen::VectorXd residuals = Eigen::VectorXd::Zero(3 * measurements.count());
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (measurements.measured[static_cast<std::size_t>(axis)])
        residuals(3 * i + axis) = measurements.positions_mm(i, axis) - model(i, axis);
    }
  }
  return residuals;
}

// The last effects of the robot are those that were found.
Question question(const Robot& robot, const std::vector<Hypothesis>& found, const Measurements& measurements,
                  const DiscoveryOptions& options) {
  const std::size_t own = robot.effects.size() - found.size();
  Question result;
  const Eigen::VectorXd residuals = stacked_residuals(robot, measurements);
  const Scene scene = make_scene(robot, measurements.poses, residuals, measurements.measured);
  result.hypotheses = catalogue_hypotheses(scene, options.catalogue, result.untestable);
  if (options.scans) {
    for (Hypothesis& scanned : scanned_effects(scene, options.catalogue))
      result.hypotheses.push_back(std::move(scanned));
  }
  add_signatures(scene, result.hypotheses);
  const Eigen::MatrixXd jacobian = position_jacobian(robot, measurements.poses);
  Eigen::VectorXd explained = residuals;
  Eigen::Index column = geometric_parameter_count(robot.chain);
  for (std::size_t e = 0; e < robot.effects.size(); ++e) {
    const Effect& effect = robot.effects[e];
    const Eigen::Index k = std::ssize(effect.values);
    if (e >= own) {
      const Eigen::Map<const Eigen::VectorXd> values(effect.values.data(), k);
      explained += jacobian.middleCols(column, k) * values;
      result.hypotheses.push_back(found_before(found[e - own], effect, jacobian.middleCols(column, k)));
    }
    column += k;
  }
  if (options.shapes) {
    for (Hypothesis& shape : shape_hypotheses(scene)) result.hypotheses.push_back(std::move(shape));
  }
  const std::vector<Eigen::Index> rows = measured_rows(measurements);
  Eigen::Index baseline = geometric_parameter_count(robot.chain);
  for (std::size_t e = 0; e < own; ++e) baseline += std::ssize(robot.effects[e].values);
  result.evidence.residuals = explained(rows);
  result.evidence.jacobian = jacobian(rows, Eigen::seqN(0, baseline));
  result.evidence.components = std::ranges::count(measurements.measured, true);
  result.evidence.repeats = repeats_of(measurements.poses);
  // Deflections over levers are a hundredth at most, and first order is wrong by a share of that.
  constexpr double first_order = 1e-5;
  result.evidence.resolution = first_order;
  for (Hypothesis& hypothesis : result.hypotheses) {
    hypothesis.candidate.signature = Eigen::MatrixXd(hypothesis.candidate.signature(rows, Eigen::all));
  }
  return result;
}

std::vector<discovery::Candidate> candidates_of(Question& question) {
  std::vector<discovery::Candidate> candidates;
  for (Hypothesis& hypothesis : question.hypotheses) candidates.push_back(hypothesis.candidate);
  return candidates;
}

std::set<std::string> labels_of(const std::vector<Hypothesis>& found) {
  std::set<std::string> labels;
  for (const Hypothesis& hypothesis : found) labels.insert(effect_label(*hypothesis.effect));
  return labels;
}

// Where the fit starts. A value that hardly moves anything can come out anywhere; plausible sizes bound it.
std::vector<double> within_limits(const discovery::Candidate& candidate, const Eigen::VectorXd& values) {
  Eigen::VectorXd bounded = values;
  if (candidate.lower.size() == values.size()) bounded = values.cwiseMax(candidate.lower).cwiseMin(candidate.upper);
  return {bounded.begin(), bounded.end()};
}

// The hypotheses of the verdict that are effects, with their values.
std::vector<Hypothesis> effects_of(const Question& question, const discovery::Verdict& verdict) {
  std::vector<Hypothesis> found;
  for (const discovery::Finding& finding : verdict.findings) {
    for (const discovery::Term& term : finding.terms) {
      const Hypothesis& hypothesis = question.hypotheses[term.candidate];
      if (!hypothesis.effect) continue;
      found.push_back(hypothesis);
      found.back().candidate.signature.resize(0, 0);
      found.back().effect->values = within_limits(hypothesis.candidate, term.values);
    }
  }
  return found;
}

Measurements without_rows(const Measurements& measurements, const std::vector<std::size_t>& left_out) {
  std::vector<std::ptrdiff_t> rows;
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    if (std::ranges::find(left_out, static_cast<std::size_t>(i)) == left_out.end()) rows.push_back(i);
  }
  return select(measurements, rows);
}

double rms(const Robot& robot, const Measurements& measurements) {
  return distances(positions(robot, measurements.poses), measurements).norm();
}

// From the registered frames; where that ends in a worse minimum than geometry alone, from the calibrated geometry.
Calibration refit(const Calibration& baseline, const std::vector<Hypothesis>& found, const Measurements& measurements,
                  const std::vector<std::size_t>& outliers, const DiscoveryOptions& options) {
  const Measurements kept = without_rows(measurements, outliers);
  CalibrationOptions calibration = options.calibration;
  calibration.start_as_given = true;
  const auto from = [&](Robot start) {
    for (const Hypothesis& hypothesis : found) start.effects.push_back(*hypothesis.effect);
    return calibrate(start, kept, calibration);
  };
  Calibration fitted = from(baseline.registered);
  if (rms(fitted.robot, kept) <= rms(baseline.robot, kept)) return fitted;
  Calibration other = from(baseline.robot);
  return rms(other.robot, kept) < rms(fitted.robot, kept) ? other : fitted;
}

// Search and refit, round after round, on one set of poses.
struct Investigation {
  Measurements searched;  // joint values moved by the maps there are
  Calibration baseline;   // without what was found
  Calibration fitted;     // with it
  std::vector<Hypothesis> found;
  discovery::Verdict verdict;
  Question asked;
  int rounds = 0;

  void search(const DiscoveryOptions& options) {
    if (found.empty()) fitted = baseline;
    for (int round = 0; round < options.rounds; ++round) {
      say(options, fmt::format("searching, round {}", ++rounds));
      asked = question(fitted.robot, found, searched, options);
      verdict = discovery::search(asked.evidence, candidates_of(asked), options.search);
      const std::set<std::string> before = labels_of(found);
      found = effects_of(asked, verdict);
      const bool as_before = found.empty() && verdict.outliers.empty();
      fitted = as_before ? baseline : refit(baseline, found, searched, verdict.outliers, options);
      if (labels_of(found) == before) break;
    }
  }

  void apply(const std::vector<Effect>& maps) {
    Robot mapped = baseline.registered;
    mapped.effects.insert(mapped.effects.end(), maps.begin(), maps.end());
    searched = unmapped(mapped, searched).measurements;
  }
};

// Free maps on top of what was found, then the search once more beside them: what they cannot be may show only now.
void add_maps(Investigation& investigation, const DiscoveryOptions& options, Discovery& result) {
  say(options, "mapping the joints");
  const Measurements kept = without_rows(investigation.searched, investigation.verdict.outliers);
  const std::optional<JointMaps> maps = fit_joint_maps(investigation.fitted.robot, kept);
  constexpr double convincing = 2.0;
  if (!maps || maps->gain_in_errors < convincing) {
    result.notes.emplace_back("Free maps of the joints do not lower the error on poses left out.");
    return;
  }
  result.maps = maps->effects;
  result.notes.push_back(fmt::format(
      "Free maps of {} joints, angle error against angle, lower the leave-one-out error from {:.4f} to {:.4f} mm.",
      maps->effects.size(), maps->before.mean(), maps->after.mean()));
  investigation.apply(maps->effects);
  CalibrationOptions calibration = options.calibration;
  calibration.start_as_given = true;
  investigation.baseline.robot =
      calibrate(investigation.baseline.registered, without_rows(investigation.searched, investigation.verdict.outliers),
                calibration)
          .robot;
  investigation.fitted = refit(investigation.baseline, investigation.found, investigation.searched,
                               investigation.verdict.outliers, options);
  investigation.search(options);
}

ErrorFigures figures(const CorrectedRobot& robot, const Measurements& measurements) {
  return error_figures(distances(positions(robot, measurements.poses), measurements));
}

// Mean length of a vector of d independent normal components.
double mean_distance(double sigma, Eigen::Index components) {
  const auto d = static_cast<double>(components);
  return sigma * std::sqrt(2.0) * std::exp(std::lgamma(0.5 * (d + 1.0)) - std::lgamma(0.5 * d));
}

// Lost beams among the poses set aside are told, not removed: nothing is chosen by these poses.
void tell_far_poses(const CorrectedRobot& improved, const Measurements& test, Discovery& result) {
  const Eigen::VectorXd errors = distances(positions(improved, test.poses), test);
  std::vector<double> sorted(errors.begin(), errors.end());
  std::ranges::nth_element(sorted, sorted.begin() + std::ssize(sorted) / 2);
  const double median = sorted[sorted.size() / 2];
  constexpr double far = 10.0;
  const auto count = (errors.array() > far * median).count();
  if (count > 0 && median > 0.0) {
    result.notes.push_back(
        fmt::format("{} of the {} poses set aside are more than ten times as far off as the median ({:.4f} mm): lost "
                    "beams, or poses unlike the others.",
                    count, errors.size(), median));
  }
}

void verify(const Measurements& searched, const Measurements& test, Eigen::Index components, Discovery& result) {
  result.fitted_before = figures({result.before, {}}, searched);
  result.fitted_after = figures(result.improved, searched);
  if (test.count() > 0) {
    // Along the axes that were fitted: what was never seen is not promised.
    Measurements common = test;
    for (std::size_t axis = 0; axis < 3; ++axis) common.measured[axis] = test.measured[axis] && searched.measured[axis];
    if (std::ranges::none_of(common.measured, [](bool seen) { return seen; })) {
      throw std::runtime_error("the test measurements share no coordinate with those that were searched");
    }
    result.held_out.before = figures({result.before, {}}, common);
    result.held_out.after = figures(result.improved, common);
    result.held_out.poses = test.count();
    tell_far_poses(result.improved, common, result);
  }
  constexpr Eigen::Index enough = 12;
  const bool repeats_speak = result.lack_of_fit.dof >= enough;
  result.held_out.floor_from_repeats = repeats_speak;
  result.held_out.floor_mm = mean_distance(repeats_speak ? result.lack_of_fit.noise : result.noise_mm, components);
}

// Calibration must leave enough freedom for anything else to be told.
void check_freedom(const Measurements& samples, const Calibration& baseline) {
  const Eigen::Index coordinates = samples.count() * std::ranges::count(samples.measured, true);
  const Eigen::Index needed = baseline.result.rank + std::max<Eigen::Index>(10, baseline.result.rank / 2);
  if (coordinates < needed) {
    throw std::runtime_error(
        fmt::format("{} poses to search give {} coordinates, of which calibration takes {}: at least {} are needed to "
                    "tell anything",
                    samples.count(), coordinates, baseline.result.rank, needed));
  }
}

// What no effect does: wrong units, order or sign of joints, another robot, too many lost beams.
void check_plausible(const Robot& robot, const Measurements& samples) {
  double reach = robot.chain.tool.xyz_mm.norm();
  for (const Joint& joint : robot.chain.joints) reach += std::abs(joint.a_mm) + std::abs(joint.d_mm);
  Eigen::VectorXd errors = distances(positions(robot, samples.poses), samples);
  std::ranges::nth_element(errors, errors.begin() + errors.size() / 2);
  const double median = errors(errors.size() / 2);
  constexpr double implausible = 0.02;
  if (reach > 0.0 && median > implausible * reach) {
    throw std::runtime_error(
        fmt::format("the calibrated model misses the measurements by {:.4g} mm, {:.0f} % of the arm's reach: no effect "
                    "does that. Check "
                    "units, order, signs and zeros of the joints, the axes of the instrument, and the description",
                    median, 100.0 * median / reach));
  }
}

bool is_exact(const Robot& robot, const Measurements& samples) {
  constexpr double rounding = 1e-10;
  const double largest = distances(positions(robot, samples.poses), samples).maxCoeff();
  return largest < rounding * std::max(1.0, samples.positions_mm.cwiseAbs().maxCoeff());
}

Discovery discover_in(const Robot& robot, const Split& split, const DiscoveryOptions& options) {
  // Maps that the robot has already move its joints; what is sought is sought beside them.
  const Unmapped plain = unmapped(robot, split.samples);
  Discovery result;
  say(options, "calibrating");
  Investigation investigation;
  investigation.searched = plain.measurements;
  investigation.baseline = calibrate(plain.robot, investigation.searched, options.calibration);
  check_freedom(investigation.searched, investigation.baseline);
  check_plausible(investigation.baseline.robot, investigation.searched);
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
  describe_shapes(investigation.asked.hypotheses, verdict, result);
  if (options.maps && verdict.answer == discovery::Answer::unknown) add_maps(investigation, options, result);
  describe_effects(investigation.asked.hypotheses, verdict, investigation.fitted, options.mass_uncertainty, result);
  describe_limits(investigation.asked.hypotheses, investigation.asked.untestable, verdict, robot, result);
  for (const std::size_t sample : verdict.outliers) {
    for (const Eigen::Index row : searched_rows(split, sample)) result.outliers.push_back(row);
  }
  const Measurements kept = without_rows(split.samples, verdict.outliers);
  result.before = calibrate(robot, kept, options.calibration).robot;
  result.rounds = investigation.rounds;
  result.improved.robot = investigation.fitted.robot;
  for (const std::vector<Effect>* maps : {&plain.maps, static_cast<const std::vector<Effect>*>(&result.maps)}) {
    result.improved.robot.effects.insert(result.improved.robot.effects.end(), maps->begin(), maps->end());
  }
  // A fit that went astray may not leave the user worse off than before.
  if (rms(result.improved.robot, kept) > rms(result.before, kept)) {
    result.improved.robot = result.before;
    result.maps.clear();
    result.notes.emplace_back(
        "The refit with what was found did not converge to anything better: the model is as calibrated.");
  }
  if (options.correct && result.answer == discovery::Answer::unknown) {
    say(options, "trying a correction");
    correct_rest(kept, options, result);
  }
  locate(kept, result);
  return result;
}

}  // namespace

Discovery discover(const Robot& robot, const Measurements& measurements, const std::optional<Measurements>& test,
                   const DiscoveryOptions& options) {
  validate(robot);
  validate(measurements, robot);
  const Split split = set_aside(measurements, test, options, Repeats::as_marked);
  const Eigen::Index components = std::ranges::count(measurements.measured, true);
  if (split.samples.count() * components < 10) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::discover: {} poses to search are too few", split.samples.count()));
  }
  Discovery result = discover_in(robot, split, options);
  // Repeats that scatter less than everything else do not show all of the noise, whatever the file says: then what was
  // found must stand without counting them as independent.
  constexpr Eigen::Index enough = 12;
  const bool doubtful = result.answer != discovery::Answer::nothing_missing && result.lack_of_fit.dof >= enough &&
                        result.lack_of_fit.p_value < 0.05;
  if (doubtful) {
    const discovery::LackOfFit repeats = result.lack_of_fit;
    result = discover_in(robot, set_aside(measurements, test, options, Repeats::averaged), options);
    result.lack_of_fit = repeats;
    result.notes.emplace_back("Repeats of a pose scatter less than the rest: each pose was counted once.");
  }
  verify(split.searched, split.test, components, result);
  return result;
}

}  // namespace llmt::robotics
