#include "report/robot/calibration_facts.hpp"

#include <algorithm>
#include <cmath>

namespace llmt::report {
namespace {

using robotics::CalibrationReport;
using robotics::error_figures;

// Figures on measurements that took no part in anything.
void judge(JudgedModel& model, const robotics::CorrectedRobot& robot, const robotics::Measurements& test) {
  const Eigen::VectorXd errors = robotics::distances(robotics::positions(robot, test.poses), test);
  const std::vector<Eigen::Index> turns = robotics::orientation_rows(test.poses);
  model.test = error_figures(errors(robotics::position_rows(test.poses)));
  if (!turns.empty()) {
    model.test_mrad = error_figures(1e3 / test.poses.observations[turns.front()].lever_mm * errors(turns));
  }
}

double mean_square(const Eigen::VectorXd& distances) {
  return distances.squaredNorm() / static_cast<double>(distances.size());
}

std::vector<CalibrationDetails::Correlation> strongest(const discovery::SolverResult& result) {
  constexpr std::size_t shown = 6;
  constexpr double notable = 0.9;
  std::vector<CalibrationDetails::Correlation> all;
  for (Eigen::Index i = 0; i < result.values.size(); ++i) {
    for (Eigen::Index j = i + 1; j < result.values.size(); ++j) {
      const double value = result.covariance(i, j) / (result.standard_errors(i) * result.standard_errors(j));
      if (std::abs(value) >= notable) all.push_back({result.parameters[i].name, result.parameters[j].name, value});
    }
  }
  std::ranges::stable_sort(all, std::greater<>{},
                           [](const CalibrationDetails::Correlation& pair) { return std::abs(pair.value); });
  if (all.size() > shown) all.resize(shown);
  return all;
}

// What every part of the model explains of the error of the described robot: on poses left out where there are folds,
// but on the poses of the fit where the description has effects.
std::vector<CalibrationDetails::Share> shares_of(const robotics::Robot& nominal,
                                                 const robotics::Measurements& measurements,
                                                 const CalibrationReport& report,
                                                 const std::optional<robotics::RepeatNoise>& repeats,
                                                 const robotics::CalibrationOptions& options) {
  const auto square = [&](const robotics::Stage& stage) {
    const bool is_held_out = stage.held_out_mm.size() > 0 && nominal.effects.empty();
    return mean_square(is_held_out ? stage.held_out_mm : stage.in_sample_mm);
  };
  std::vector<CalibrationDetails::Share> shares;
  double whole = square(report.nominal);
  double left = square(report.geometric);
  double effects = 0.0;
  if (!nominal.effects.empty()) {
    robotics::Robot rigid = nominal;
    rigid.effects.clear();
    const robotics::Calibration without = robotics::calibrate(rigid, measurements, options);
    const std::vector<Eigen::Index> points = robotics::position_rows(measurements.poses);
    const auto error_of = [&](const robotics::Robot& robot) {
      return mean_square(robotics::distances(robotics::positions(robot, measurements.poses), measurements)(points));
    };
    whole = error_of(without.registered);
    effects = error_of(without.robot) - error_of(report.calibration.robot);
  }
  if (!(whole > 0.0)) return {};
  shares.push_back({"geometry", (whole - left - effects) / whole});
  if (!nominal.effects.empty()) shares.push_back({"effects", effects / whole});
  if (report.correction_kept) {
    const double corrected = square(*report.corrected);
    shares.push_back({"correction by trees", (left - corrected) / whole});
    left = corrected;
  }
  if (repeats) {
    const auto coordinates = static_cast<double>(std::ranges::count(measurements.measured, true));
    const double noise = std::min(left, coordinates * repeats->sigma_mm * repeats->sigma_mm);
    shares.push_back({"noise of repeats", noise / whole});
    left -= noise;
  }
  shares.push_back({repeats ? "unexplained" : "unexplained and noise", left / whole});
  return shares;
}

}  // namespace

std::vector<JudgedModel> judged_models(const CalibrationReport& report, const robotics::Measurements& measurements,
                                       const std::optional<robotics::Measurements>& test, bool new_session) {
  std::vector<JudgedModel> models = {{"nominal", report.nominal}, {"geometric", report.geometric}};
  if (report.corrected) models.push_back({"corrected", *report.corrected});
  if (!test) return models;
  const robotics::Poses known = new_session ? robotics::Poses{} : measurements.poses;
  const auto placed = [&](const robotics::Robot& robot) { return with_placed_frames(robot, *test, known); };
  judge(models[0], {placed(report.calibration.registered), std::nullopt}, *test);
  const robotics::Robot calibrated = placed(report.calibration.robot);
  judge(models[1], {calibrated, std::nullopt}, *test);
  if (report.corrected) judge(models[2], {calibrated, report.correction}, *test);
  return models;
}

CalibrationDetails calibration_details(const robotics::Robot& nominal, const robotics::Measurements& measurements,
                                       const CalibrationReport& report, const robotics::ReportOptions& options) {
  CalibrationDetails details;
  const Eigen::VectorXd errors = robotics::leave_one_out(report.calibration, measurements);
  details.leave_one_out_mm = errors(robotics::position_rows(measurements.poses)).mean();
  details.seen = robotics::observability_of(report.calibration, measurements);
  details.repeats = robotics::noise_of_repeats(measurements);
  details.correlations = strongest(report.calibration.result);
  details.shares = shares_of(nominal, measurements, report, details.repeats, options.calibration);
  return details;
}

}  // namespace llmt::report
