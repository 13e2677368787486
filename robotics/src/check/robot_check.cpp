#include "llmt/robotics/robot_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calibration/free_parameters.hpp"
#include "check/f_tail.hpp"
#include "check/movements.hpp"

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

double mean_distance(double noise_mm, const Measurements& measurements) {
  // Of normal noise in one, two, three coordinates.
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
  const double error =
      spread * std::sqrt(1.0 / static_cast<double>(measurements.count()) + 1.0 / static_cast<double>(record.poses));
  constexpr double one_in_a_hundred = 2.33;
  constexpr double immaterial = 1.1;
  result.limit_mm = std::max(immaterial * result.accuracy_mm, result.accuracy_mm + one_in_a_hundred * error);
}

// Columns of the Jacobian that take part: all but joint maps and what the convention leaves out.
std::vector<Eigen::Index> columns_of(const Robot& robot) {
  const std::vector<std::string> reasons = reasons_to_fix(robot, {});
  const std::set<std::string> unseen = unseen_by_touch(robot);
  const std::vector<discovery::Parameter> all = parameters(robot);
  std::vector<Eigen::Index> columns;
  Eigen::Index next = 0;
  for (; next < geometric_parameter_count(robot.chain); ++next) {
    if (reasons[next].empty() && !unseen.contains(all[next].name)) columns.push_back(next);
  }
  for (const Effect& effect : robot.effects) {
    for (std::size_t k = 0; k < effect.values.size(); ++k, ++next) {
      if (effect.type != "joint_map") columns.push_back(next);
    }
  }
  return columns;
}

// Of any session, and of any target: "base@tuesday.x" belongs to a base.
bool is_of_base(const std::string& name) { return name.starts_with("base.") || name.starts_with("base@"); }

bool is_turn_of_tool(const std::string& name) {
  return (name.starts_with("tool.") || name.starts_with("tool@")) && name[name.rfind('.') + 1] == 'r';
}

// Every parameter, and groups of those of an effect, of the tool's position, of the base.
std::vector<Suspect> suspects_of(const std::vector<discovery::Parameter>& parameters, Eigen::Index geometric,
                                 bool same_session) {
  std::vector<Suspect> all;
  std::vector<Suspect> groups;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const std::string& name = parameters[k].name;
    if (!same_session && is_of_base(name)) continue;
    if (is_turn_of_tool(name)) continue;
    const auto column = static_cast<Eigen::Index>(k);
    all.push_back({name, {column}});
    const std::string owner = owner_of(name);
    if (column < geometric && !is_frame_parameter(name)) continue;  // of a joint
    const auto known = std::ranges::find(groups, owner, &Suspect::name);
    if (known == groups.end()) {
      groups.push_back({owner, {column}});
    } else {
      known->columns.push_back(column);
    }
  }
  std::erase_if(groups, [](const Suspect& group) { return group.columns.size() < 2; });
  all.insert(all.end(), groups.begin(), groups.end());
  return all;
}

// Of the calibrated values over their scales; columns of `nuisance` count as exact, for they are fitted anew.
Eigen::MatrixXd covariance_of(const Robot& robot, const std::vector<discovery::Parameter>& parameters,
                              const std::vector<Eigen::Index>& nuisance) {
  std::vector<Eigen::Index> place;
  std::vector<double> error;
  for (const IdentifiedParameter& entry : robot.identified) {
    if (!entry.standard_error) continue;
    const auto named = std::ranges::find(parameters, entry.name, &discovery::Parameter::name);
    const Eigen::Index column = named == parameters.end() ? -1 : named - parameters.begin();
    const bool is_exact = column < 0 || std::ranges::count(nuisance, column) > 0;
    place.push_back(is_exact ? -1 : column);
    error.push_back(is_exact ? 0.0 : *entry.standard_error / named->scale);
  }
  const Eigen::MatrixXd* correlations = robot.calibration ? &robot.calibration->correlations : nullptr;
  const bool are_known = correlations != nullptr && correlations->rows() == std::ssize(place);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(std::ssize(parameters), std::ssize(parameters));
  for (std::size_t i = 0; i < place.size(); ++i) {
    for (std::size_t k = 0; k < place.size(); ++k) {
      if (place[i] < 0 || place[k] < 0 || (!are_known && i != k)) continue;
      covariance(place[i], place[k]) = error[i] * error[k] * (are_known ? (*correlations)(i, k) : 1.0);
    }
  }
  return covariance;
}

double mean_of_poses(const Eigen::VectorXd& stacked, const std::vector<Eigen::Index>& rows, Eigen::Index poses) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(poses);
  for (Eigen::Index i = 0; i < stacked.size(); ++i) squares(rows[i] / 3) += stacked(i) * stacked(i);
  return squares.cwiseSqrt().mean();
}

// `robot` has base and tool fitted to the measurements, `before` those of the calibration. Derivatives are taken at the
// fitted ones: a target that was mounted elsewhere is far from the old one.
void find_moved(const CorrectedRobot& robot, const Robot& before, const Measurements& measurements,
                const CheckOptions& options, RobotCheck& result) {
  const std::vector<Eigen::Index> rows = measured_rows(measurements);
  const std::vector<Eigen::Index> columns = columns_of(robot.robot);
  const std::vector<discovery::Parameter> all = robotics::parameters(robot.robot);
  std::vector<discovery::Parameter> parameters;
  for (const Eigen::Index column : columns) parameters.push_back(all[column]);
  MovementProblem problem;
  problem.level = options.level;
  problem.jacobian = position_jacobian(robot.robot, measurements.poses, columns)(rows, Eigen::all);
  for (std::size_t k = 0; k < parameters.size(); ++k) problem.jacobian.col(k) *= parameters[k].scale;
  const Eigen::MatrixXd missing = (measurements.positions_mm - positions(robot, measurements.poses)).transpose();
  problem.residuals = missing.reshaped()(rows);
  const std::vector<discovery::Parameter> calibrated = robotics::parameters(before);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const double by = (parameters[k].value - calibrated[columns[k]].value) / parameters[k].scale;
    if (!is_of_base(parameters[k].name)) problem.residuals += by * problem.jacobian.col(k);
  }
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (!options.same_session && is_of_base(parameters[k].name)) {
      problem.nuisance.push_back(static_cast<Eigen::Index>(k));
    }
  }
  problem.covariance = covariance_of(robot.robot, parameters, problem.nuisance);
  const Eigen::Index geometric =
      std::ranges::lower_bound(columns, geometric_parameter_count(robot.robot.chain)) - columns.begin();
  problem.suspects = suspects_of(parameters, geometric, options.same_session);
  const Movements movements = find_movements(problem);
  for (const Movement& movement : movements.found) {
    const Suspect& suspect = problem.suspects[movement.suspect];
    Moved moved{.name = suspect.name, .changes = {}, .probability = movement.probability, .or_else = {}};
    for (std::size_t k = 0; k < suspect.columns.size(); ++k) {
      const discovery::Parameter& parameter = parameters[suspect.columns[k]];
      moved.changes.push_back({parameter.name, parameter.unit, movement.changes[k] * parameter.scale,
                               movement.standard_errors[k] * parameter.scale});
    }
    for (const std::size_t other : movement.or_else) moved.or_else.push_back(problem.suspects[other].name);
    result.moved.push_back(std::move(moved));
  }
  for (const std::size_t unseen : movements.unseen) result.unseen.push_back(problem.suspects[unseen].name);
  result.tested = std::ssize(problem.suspects) - std::ssize(movements.unseen);
  result.noise_mm = movements.noise;
  result.refitted_mm = mean_of_poses(movements.left, rows, measurements.count());
  if (!robot.robot.calibration) return;
  const CalibrationRecord& record = *robot.robot.calibration;
  result.noise_before_mm = record.noise_mm;
  const double known = static_cast<double>(record.coordinates - record.correlations.rows());
  if (!(movements.freedom > 0.0 && known > 0.0 && record.noise_mm > 0.0)) return;
  constexpr double rare = 0.01;
  constexpr double material = 1.33;
  const double ratio = movements.noise / record.noise_mm;
  result.unexplained = ratio > material && f_tail(ratio * ratio, movements.freedom, known) < rare;
}

RobotCheck check_all(const CorrectedRobot& robot, const Measurements& measurements, const CheckOptions& options) {
  RobotCheck result;
  set_limit(robot.robot, measurements, options, result);
  const CalibrationRecord* record = robot.robot.calibration ? &*robot.robot.calibration : nullptr;
  result.has_correlations = record != nullptr && record->correlations.size() > 0;
  CorrectedRobot judged = robot;
  if (!options.same_session) judged = registered(robot, measurements, {});
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

}  // namespace

RobotCheck check_robot(const CorrectedRobot& robot, const Measurements& measurements, const CheckOptions& options) {
  check(robot, measurements, options);
  RobotCheck result = check_all(robot, measurements, options);
  const CalibrationRecord* record = robot.robot.calibration ? &*robot.robot.calibration : nullptr;
  if (record == nullptr || record->joint_ranges.empty()) return result;
  result.beyond = joints_beyond(robot.robot.chain, record->joint_ranges, measurements.poses);
  result.uncovered = rows_beyond(result.beyond);
  if (!result.uncovered.empty()) result = decided_by_covered(robot, measurements, options, std::move(result));
  result.has_ranges = true;
  return result;
}

}  // namespace llmt::robotics
