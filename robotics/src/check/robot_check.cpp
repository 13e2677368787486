#include "llmt/robotics/robot_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "check/bad_readings.hpp"
#include "check/moved_parameters.hpp"

namespace llmt::robotics {
namespace {

void require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument("llmt::robotics::check_robot: " + what);
}

// Nine values of base and tool are fitted.
Eigen::Index fewest_poses(const CheckOptions& options) { return options.same_session ? 5 : 8; }

void check(const CorrectedRobot& robot, const Measurements& measurements, const CheckOptions& options) {
  validate(robot.robot);
  validate(measurements, robot.robot);
  require(options.level > 0.0 && options.level <= 0.5,
          fmt::format("level is {}, must be above 0 and at most 0.5", options.level));
  require(!options.accuracy_mm || (*options.accuracy_mm > 0.0 && std::isfinite(*options.accuracy_mm)),
          "accuracy_mm must be > 0");
  require(measurements.count() >= fewest_poses(options),
          fmt::format("there are {} poses, at least {} are needed{}", measurements.count(), fewest_poses(options),
                      options.same_session ? "" : " where base and tool are fitted"));
  const auto is_identified = [](const IdentifiedParameter& entry) { return entry.standard_error.has_value(); };
  require(std::ranges::any_of(robot.robot.identified, is_identified),
          "the description has no identified parameters with standard errors: it was not calibrated");
}

// The robot with its frames fitted as the options of a calibration allow; the correction turns with the base.
CorrectedRobot registered(CorrectedRobot robot, const Measurements& measurements, const CalibrationOptions& options) {
  Measurements without = measurements;
  register_frames(robot.robot, without, options);
  if (!robot.correction) return robot;
  without.positions_mm -= positions(robot, measurements.poses) - positions(robot.robot, measurements.poses);
  register_frames(robot.robot, without, options);
  return robot;
}

CorrectedRobot as_set_up(const CorrectedRobot& robot, const Measurements& measurements, const CheckOptions& options) {
  return options.same_session ? robot : registered(robot, measurements, {});
}

double mean_distance(double noise_mm, const Measurements& measurements) {
  // Mean lengths of normal noise in one, two, three coordinates.
  constexpr double factors[] = {0.797885, 1.253314, 1.595769};
  return noise_mm * factors[std::ranges::count(measurements.measured, true) - 1];
}

void set_limit(const Robot& robot, const Measurements& measurements, const CheckOptions& options, RobotCheck& result) {
  if (options.accuracy_mm) {
    result.accuracy_mm = result.limit_mm = *options.accuracy_mm;
    return;
  }
  require(
      robot.calibration.has_value(),
      "the description does not say how accurate it was: accuracy_mm is needed, or a calibration of today's format");
  const CalibrationRecord& record = *robot.calibration;
  // Errors of two coordinates are smaller than those of three.
  const auto axes = std::ranges::count(measurements.measured, true);
  const bool had_three = record.coordinates >= 3 * record.poses;
  const bool is_alike = axes == 3 ? had_three : !had_three && record.coordinates == axes * record.poses;
  const bool has_error = record.held_out_mm && is_alike;
  result.accuracy_is_of_noise = !has_error;
  result.accuracy_mm = has_error ? *record.held_out_mm : mean_distance(record.noise_mm, measurements);
  constexpr double share_of_mean = 0.422;  // standard deviation of a normal vector's length over its mean
  const double of_noise = share_of_mean * result.accuracy_mm;
  const double spread = has_error ? record.held_out_sd_mm.value_or(of_noise) : of_noise;
  const Eigen::Index poses = has_error && record.held_out_poses > 0 ? record.held_out_poses : record.poses;
  const double error =
      spread * std::sqrt(1.0 / static_cast<double>(measurements.count()) + 1.0 / static_cast<double>(poses));
  constexpr double one_in_a_hundred = 2.33;
  constexpr double immaterial = 1.1;
  result.limit_mm = std::max(immaterial * result.accuracy_mm, result.accuracy_mm + one_in_a_hundred * error);
}

RobotCheck check_all(const CorrectedRobot& robot, const Measurements& measurements, const CheckOptions& options) {
  RobotCheck result;
  set_limit(robot.robot, measurements, options, result);
  const CalibrationRecord* record = robot.robot.calibration ? &*robot.robot.calibration : nullptr;
  result.has_correlations = record != nullptr && record->correlations.size() > 0;
  const CorrectedRobot judged = as_set_up(robot, measurements, options);
  result.errors_mm = distances(positions(judged, measurements.poses), measurements);
  result.error = result.covered_error = error_figures(result.errors_mm);
  result.still_good = result.good_where_covered = result.error.mean <= result.limit_mm;
  find_moved(judged, robot.robot, measurements, options, result);
  return result;
}

// `result` is that of all poses; the covered ones decide what moved.
RobotCheck decided_by_covered(const CorrectedRobot& robot, const Measurements& measurements,
                              const CheckOptions& options, RobotCheck result) {
  const std::vector<std::size_t> rows(result.uncovered.begin(), result.uncovered.end());
  const Measurements covered = without_rows(measurements, rows);
  result.too_few_covered = covered.count() < fewest_poses(options);
  RobotCheck decided = result;
  if (result.too_few_covered) {
    decided.moved.clear();
    decided.covered_error = {};
    decided.good_where_covered = false;
    decided.unexplained = false;
  } else {
    decided = check_all(robot, covered, options);
    decided.covered_error = decided.error;
    decided.good_where_covered = decided.still_good;
  }
  for (const Moved& moved : result.moved) {
    if (std::ranges::find(decided.moved, moved.name, &Moved::name) == decided.moved.end()) {
      decided.moved_beyond.push_back(moved);
    }
  }
  static_cast<CheckedError&>(decided) = result;
  return decided;
}

std::vector<Eigen::Index> left_of(Eigen::Index count, const std::vector<std::size_t>& out) {
  std::vector<Eigen::Index> left;
  for (Eigen::Index row = 0; row < count; ++row) {
    if (std::ranges::count(out, static_cast<std::size_t>(row)) == 0) left.push_back(row);
  }
  return left;
}

// Rows in ascending order. Base and tool are fitted anew without those found, until there are no more. Poses beyond the
// calibrated ranges take no part: there the calibration may be wrong without anything being bad.
std::vector<std::size_t> bad_rows(const CorrectedRobot& robot, const Measurements& measurements,
                                  const CheckOptions& options) {
  constexpr double level = 0.001;
  constexpr Eigen::Index one_of = 5;
  constexpr int most_rounds = 4;
  std::vector<std::size_t> out;
  if (robot.robot.calibration) {
    for (const Eigen::Index row :
         rows_beyond(beyond_calibrated(robot.robot.chain, *robot.robot.calibration, measurements.poses))) {
      out.push_back(static_cast<std::size_t>(row));
    }
  }
  Eigen::Index most = (measurements.count() - std::ssize(out)) / one_of;
  std::vector<std::size_t> bad;
  for (int round = 0; round < most_rounds && most > 0; ++round) {
    const Measurements left = without_rows(measurements, out);
    if (left.count() <= fewest_poses(options)) break;
    const std::vector<Eigen::Index> places = left_of(measurements.count(), out);
    const Linearised linear = linearised(as_set_up(robot, left, options), robot.robot, left, options);
    std::vector<Eigen::Index> reading_of;
    for (const Eigen::Index row : linear.rows) reading_of.push_back(row / 3);
    const std::vector<Eigen::Index> found = bad_readings(linear.problem.jacobian, linear.problem.residuals, reading_of,
                                                         std::min(most, left.count() - fewest_poses(options)), level);
    if (found.empty()) break;
    most -= std::ssize(found);
    for (const Eigen::Index reading : found) {
      bad.push_back(static_cast<std::size_t>(places[reading]));
      out.push_back(bad.back());
    }
    std::ranges::sort(out);
  }
  std::ranges::sort(bad);
  return bad;
}

bool is_of_frame(const std::string& name) {
  return is_of_base(name + ".") || is_of_base(name) || name.starts_with("tool");
}

// Where the instrument was set up anew, a target that was mounted anew is no change of the arm.
CheckVerdict verdict_of(const RobotCheck& check, const CheckOptions& options) {
  if (!check.still_good) return CheckVerdict::no_longer_good;
  const bool has_moved = std::ranges::any_of(
      check.moved, [&](const Moved& moved) { return options.same_session || !is_of_frame(moved.name); });
  return has_moved || check.unexplained ? CheckVerdict::moved_within_limits : CheckVerdict::still_good;
}

RobotCheck check_good_readings(const CorrectedRobot& robot, const Measurements& measurements,
                               const CheckOptions& options) {
  RobotCheck result = check_all(robot, measurements, options);
  const CalibrationRecord* record = robot.robot.calibration ? &*robot.robot.calibration : nullptr;
  if (record == nullptr || record->joint_ranges.empty()) return result;
  result.beyond = beyond_calibrated(robot.robot.chain, *record, measurements.poses);
  result.uncovered = rows_beyond(result.beyond);
  if (!result.uncovered.empty()) result = decided_by_covered(robot, measurements, options, std::move(result));
  result.has_ranges = true;
  return result;
}

}  // namespace

std::string to_string(CheckVerdict verdict) {
  switch (verdict) {
    case CheckVerdict::still_good:
      return "still good";
    case CheckVerdict::moved_within_limits:
      return "moved, within limits";
    case CheckVerdict::no_longer_good:
      return "no longer good";
  }
  return "";
}

RobotCheck check_robot(const CorrectedRobot& robot, const Measurements& measurements, const CheckOptions& options) {
  check(robot, measurements, options);
  const std::vector<std::size_t> bad = bad_rows(robot, measurements, options);
  const Measurements good = without_rows(measurements, bad);
  RobotCheck result = check_good_readings(robot, good, options);
  result.judged = left_of(measurements.count(), bad);
  for (Eigen::Index& row : result.uncovered) row = result.judged[row];
  for (Beyond& own : result.beyond) {
    for (Eigen::Index& row : own.rows) row = result.judged[row];
  }
  if (!bad.empty()) {
    const Eigen::VectorXd errors =
        distances(positions(as_set_up(robot, good, options), measurements.poses), measurements);
    for (const std::size_t row : bad) {
      result.bad.push_back({static_cast<Eigen::Index>(row), errors(static_cast<Eigen::Index>(row))});
    }
  }
  result.verdict = verdict_of(result, options);
  return result;
}

}  // namespace llmt::robotics
