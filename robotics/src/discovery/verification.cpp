#include "discovery/verification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "discovery/investigation/unsound_effects.hpp"
#include "discovery/rest_correction.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

Eigen::Index count_of_stands(const Poses& poses) {
  if (poses.observations.empty()) return poses.count();
  std::set<Eigen::Index> stands;
  for (const Observation& seen : poses.observations) stands.insert(seen.stand);
  return std::ssize(stands);
}

// Mean length of a vector of d independent normal components.
double mean_distance(double sigma, Eigen::Index components) {
  const auto d = static_cast<double>(components);
  return sigma * std::sqrt(2.0) * std::exp(std::lgamma(0.5 * (d + 1.0)) - std::lgamma(0.5 * d));
}

// The poses set aside, along the axes that were fitted.
Measurements along_fitted_axes(const PoseSplit& split) {
  Measurements common = split.test;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    common.measured[axis] = split.test.measured[axis] && split.searched.measured[axis];
  }
  if (std::ranges::none_of(common.measured, [](bool seen) { return seen; })) {
    throw std::runtime_error("the test measurements share no coordinate with those that were searched");
  }
  return common;
}

}  // namespace

Robots fit_robots(const Robot& robot, const Measurements& samples, const std::vector<Effect>& given,
                  const Findings& found, const DiscoveryOptions& options) {
  const Measurements kept = without_rows(samples, found.investigation.verdict.outliers);
  Robots robots{
      calibrate(robot, kept, options.calibration).robot, {found.investigation.fitted.robot, {}}, found.maps, {}};
  std::vector<Effect>& effects = robots.improved.robot.effects;
  for (const std::vector<Effect>* maps : {&given, &found.maps})
    effects.insert(effects.end(), maps->begin(), maps->end());
  if (!(total_distance(robots.improved.robot, kept) <= total_distance(robots.before, kept))) {
    robots.is_worse = !found.names.empty() || !found.maps.empty();
    robots = withdrawn(std::move(robots));
  }
  if (robots.is_worse) {
    robots.notes.emplace_back(
        "The refit with what was found did not converge to anything better: the model is as calibrated.");
  }
  if (options.correct && found.investigation.verdict.answer == discovery::Answer::unknown) {
    report_progress(*found.investigation.work, "trying a correction");
    add_correction(kept, options.seed, *found.investigation.work, robots.improved, robots.notes);
  }
  return robots;
}

Robots withdrawn(Robots robots) {
  robots.improved = {robots.before, {}};
  robots.maps.clear();
  return robots;
}

std::optional<PairedDifference> held_out_gain(const Robots& robots, const PoseSplit& split) {
  const bool is_changed =
      robots.improved.robot.effects.size() != robots.before.effects.size() || robots.improved.correction.has_value();
  if (split.test.count() < 3 || !is_changed) return std::nullopt;
  const Measurements common = along_fitted_axes(split);
  return paired_difference(distances(positions(robots.before, common.poses), common),
                           distances(positions(robots.improved, common.poses), common));
}

std::optional<Objection> judge_held_out_loss(const std::optional<PairedDifference>& gain, std::size_t names) {
  if (!gain || gain->mean > 0.0) return std::nullopt;
  Objection objection{Reason::held_out_loss};
  for (std::size_t k = 0; k < names; ++k) objection.names.push_back(k);
  objection.notes.push_back(
      fmt::format("What was found does not make the poses set aside better: their mean error rises by {:.4f} +- {:.4f} "
                  "mm. The description is as calibrated{}.",
                  -gain->mean, gain->standard_error, names > 0 ? ", and the names are guesses" : ""));
  return objection;
}

std::optional<std::string> far_poses_note(const Robots& robots, const PoseSplit& split) {
  if (split.test.count() == 0) return std::nullopt;
  const Measurements common = along_fitted_axes(split);
  const Eigen::VectorXd errors = distances(positions(robots.improved, common.poses), common);
  const double typical = median(errors);
  constexpr double far = 10.0;
  const auto count = (errors.array() > far * typical).count();
  if (count == 0 || !(typical > 0.0)) return std::nullopt;
  return fmt::format(
      "{} of the {} poses set aside are more than ten times as far off as the median ({:.4f} mm): lost beams, or poses "
      "unlike the others.",
      count, errors.size(), typical);
}

Eigen::VectorXd position_errors(const CorrectedRobot& robot, const Measurements& measurements) {
  const Eigen::VectorXd errors = distances(positions(robot, measurements.poses), measurements);
  return errors(position_rows(measurements.poses));
}

ErrorFigures figures(const CorrectedRobot& robot, const Measurements& measurements) {
  return error_figures(position_errors(robot, measurements));
}

HeldOut verify(const Robots& robots, const PoseSplit& split, const discovery::LackOfFit& lack_of_fit, double noise_mm) {
  HeldOut held_out;
  if (split.test.count() > 0) {
    const Measurements common = along_fitted_axes(split);
    held_out.before_mm = position_errors({robots.before, {}}, common);
    held_out.after_mm = position_errors(robots.improved, common);
    held_out.before = error_figures(held_out.before_mm);
    held_out.after = error_figures(held_out.after_mm);
    held_out.poses = count_of_stands(split.test.poses);
    held_out.rows = split.aside;
  }
  held_out.floor_from_repeats = lack_of_fit.has_enough_repeats();
  held_out.floor_mm = mean_distance(held_out.floor_from_repeats ? lack_of_fit.noise : noise_mm,
                                    std::ranges::count(split.searched.measured, true));
  return held_out;
}

void remember_held_out_errors(const PoseSplit& split, const CorrectedRobot& judged, CorrectedRobot& written) {
  std::optional<CalibrationRecord>& record = written.robot.calibration;
  if (split.test.count() < 2 || !record || split.test.measured != split.searched.measured) return;
  remember_errors(*record, position_errors(judged, split.test));
}

}  // namespace llmt::robotics
