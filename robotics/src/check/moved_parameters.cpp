#include "check/moved_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "calibration/free_parameters.hpp"
#include "check/f_tail.hpp"
#include "check/shared_error.hpp"
#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {
namespace {

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
      if (nature_of(effect) != Nature::map) columns.push_back(next);
    }
  }
  return columns;
}

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

// The covariance of the calibrated values over their scales; columns of `nuisance` count as exact, for they are fitted
// anew.
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

// The noise of a coordinate at the calibration. Readings that lay far off do not count in the error on poses left out.
double noise_of(const CalibrationRecord& record) {
  constexpr double mean_length = 1.595769;  // of normal noise in three coordinates
  if (!record.held_out_mm || record.coordinates < 3 * record.poses) return record.noise_mm;
  return std::min(record.noise_mm, *record.held_out_mm / mean_length);
}

double mean_of_poses(const Eigen::VectorXd& stacked, const std::vector<Eigen::Index>& rows, Eigen::Index poses) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(poses);
  for (Eigen::Index i = 0; i < stacked.size(); ++i) squares(rows[i] / 3) += stacked(i) * stacked(i);
  return squares.cwiseSqrt().mean();
}

}  // namespace

bool is_of_base(const std::string& name) { return name.starts_with("base.") || name.starts_with("base@"); }

Linearised linearised(const CorrectedRobot& robot, const Robot& before, const Measurements& measurements,
                      const CheckOptions& options) {
  Linearised result;
  result.rows = measured_rows(measurements);
  const std::vector<Eigen::Index> columns = columns_of(robot.robot);
  const std::vector<discovery::Parameter> all = robotics::parameters(robot.robot);
  std::vector<discovery::Parameter>& parameters = result.parameters;
  for (const Eigen::Index column : columns) parameters.push_back(all[column]);
  result.geometric = std::ranges::lower_bound(columns, geometric_parameter_count(robot.robot.chain)) - columns.begin();
  MovementProblem& problem = result.problem;
  problem.jacobian = position_jacobian(robot.robot, measurements.poses, columns)(result.rows, Eigen::all);
  for (std::size_t k = 0; k < parameters.size(); ++k) problem.jacobian.col(k) *= parameters[k].scale;
  const Eigen::MatrixXd missing = (measurements.positions_mm - positions(robot, measurements.poses)).transpose();
  problem.residuals = missing.reshaped()(result.rows);
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
  return result;
}

void find_moved(const CorrectedRobot& robot, const Robot& before, const Measurements& measurements,
                const CheckOptions& options, RobotCheck& result) {
  auto [parameters, geometric, problem, rows] = linearised(robot, before, measurements, options);
  problem.level = options.level;
  problem.covariance = covariance_of(robot.robot, parameters, problem.nuisance);
  problem.suspects = suspects_of(parameters, geometric, options.same_session);
  const auto [noise, freedom] = unexplained(problem.jacobian, problem.residuals);
  const double known_noise = robot.robot.calibration ? noise_of(*robot.robot.calibration) : 0.0;
  const PointRows points = point_rows(robot.robot.chain, measurements, rows);
  const SharedError shared = likeliest_shared_error(points, problem.jacobian, problem.residuals, known_noise);
  problem.least_noise = shared.sigma;
  problem.jacobian = whitened(shared, points, std::move(problem.jacobian));
  problem.residuals = whitened(shared, points, problem.residuals);
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
  result.noise_mm = noise;
  result.refitted_mm = mean_of_poses(coloured(shared, points, movements.left), rows, measurements.count());
  if (!robot.robot.calibration) return;
  const CalibrationRecord& record = *robot.robot.calibration;
  result.noise_before_mm = record.noise_mm;
  const double known = static_cast<double>(record.coordinates - record.correlations.rows());
  if (!(freedom > 0.0 && known > 0.0 && record.noise_mm > 0.0)) return;
  constexpr double rare = 0.01;
  constexpr double material = 1.33;
  const double ratio = noise / record.noise_mm;
  result.unexplained = ratio > material && f_tail(ratio * ratio, freedom, known) < rare;
}

}  // namespace llmt::robotics
