#include "llmt/robotics/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <set>
#include <string>

#include "calibration/frame_start.hpp"
#include "calibration/free_parameters.hpp"
#include "calibration/joint_map_shift.hpp"
#include "calibration/joint_ranges.hpp"
#include "calibration/noise_model.hpp"
#include "calibration/still_joints.hpp"
#include "calibration/travel.hpp"
#include "linear_algebra/linear_algebra.hpp"
#include "llmt/robotics/calibration_problem.hpp"

namespace llmt::robotics {
namespace {

double lever_of(const Measurements& measurements) {
  const std::vector<Eigen::Index> turns = orientation_rows(measurements.poses);
  return turns.empty() ? 1.0 : measurements.poses.observations[turns.front()].lever_mm;
}

// A calibration in the making: what is fitted, from where, and the result so far.
struct Fit {
  Robot robot;
  discovery::LeastSquaresProblem problem;
  CommonNoise noise;
  discovery::SolverResult result = {};
};

void fit_once(Fit& fit, const NoiseModel& model, const std::vector<std::string>& reasons,
              const discovery::SolverOptions& solver) {
  fit.problem.weights = model.weights(fit.noise);
  fit.result = solve_for(fit.robot, fit.problem, reasons, solver);
  for (std::size_t k = 0; k < reasons.size(); ++k) fit.problem.parameters[k].value = fit.result.values(k);
  fit.noise = model.estimate(fit.result.residuals, fit.result.rank);
}

// Least squares with priors. The weight of the data against the priors depends on the noise, which the residuals of the
// registered robot overestimate. So the fit is repeated from its own result, with the noise of the fit before, until
// the noise settles.
void fit_until_noise_settles(Fit& fit, const NoiseModel& model, const std::vector<std::string>& reasons,
                             const discovery::SolverOptions& solver, int largest_number_of_passes) {
  const auto is_settled = [](double now, double then) { return now > 0.95 * then || then == 0.0; };
  for (int pass = 0; pass < largest_number_of_passes; ++pass) {
    const CommonNoise before = fit.noise;
    fit_once(fit, model, reasons, solver);
    if (is_settled(fit.noise.position_mm, before.position_mm) &&
        is_settled(fit.noise.orientation_mm, before.orientation_mm)) {
      return;
    }
  }
}

// Priors around a description that is far off keep the fit far from the minimum: the rest there counts as noise, and
// that gives the priors their weight. A fit without them finds the way, after which they come back.
Fit begun_without_priors(const Fit& fit, const discovery::LeastSquaresProblem& unweighted, const NoiseModel& model,
                         const std::vector<std::string>& reasons, const CalibrationOptions& options) {
  CalibrationOptions data_alone = options;
  data_alone.prior_length_mm = 0.0;
  data_alone.prior_angle_deg = 0.0;
  std::vector<discovery::Parameter> own = unweighted.parameters;
  set_priors(own, geometric_parameter_count(fit.robot.chain), data_alone);
  Fit other = fit;
  for (std::size_t k = 0; k < own.size(); ++k) other.problem.parameters[k].prior_sigma = own[k].prior_sigma;
  fit_once(other, model, reasons, options.solver);
  for (std::size_t k = 0; k < own.size(); ++k) {
    other.problem.parameters[k].prior_sigma = fit.problem.parameters[k].prior_sigma;
  }
  constexpr int passes = 10;
  fit_until_noise_settles(other, model, reasons, options.solver, passes);
  return other;
}

// By more than a fiftieth of the arm's length, as input_mistakes() has it, but not so far that it is another arm, or a
// table that is not meant as it stands.
bool is_far_off(double reach_mm, const CommonNoise& registered) {
  const double share = std::sqrt(3.0) * registered.position_mm / reach_mm;
  constexpr double far = 0.02;
  constexpr double too_far = 0.25;
  return share > far && share < too_far;
}

void identify(Calibration& calibration, const Measurements& measurements,
              const discovery::LeastSquaresProblem& unweighted, const std::vector<std::string>& reasons,
              const CalibrationOptions& options) {
  const bool has_priors = options.prior_length_mm > 0.0 || options.prior_angle_deg > 0.0;
  const bool is_weighed = has_priors || !orientation_rows(measurements.poses).empty() ||
                          (stated_sigma_mm(measurements).array() > 0.0).any();
  const NoiseModel model(measurements, options);
  Fit start{calibration.robot, unweighted, model.estimate(calibration.registration.residuals, 0)};
  set_priors(start.problem.parameters, geometric_parameter_count(calibration.robot.chain), options);
  Fit fit = start;
  fit_until_noise_settles(fit, model, reasons, options.solver, is_weighed ? 10 : 1);
  const double reach_mm = reach_of(calibration.robot.chain) + travel_of(calibration.robot.chain, measurements.poses);
  if (has_priors && is_far_off(reach_mm, start.noise)) {
    Fit other = begun_without_priors(fit, unweighted, model, reasons, options);
    constexpr double better = 0.9;
    constexpr double plausible = 0.002;  // of the arm's length, mm per coordinate
    calibration.began_without_priors =
        other.noise.position_mm < std::min(better * fit.noise.position_mm, plausible * reach_mm);
    if (calibration.began_without_priors) fit = std::move(other);
  }
  calibration.robot = std::move(fit.robot);
  calibration.result = std::move(fit.result);
  calibration.noise_mm = fit.noise.position_mm;
  calibration.orientation_noise_mrad = 1e3 * fit.noise.orientation_mm / lever_of(measurements);
  for (std::size_t k = 0; k < reasons.size(); ++k) {
    const discovery::Parameter& parameter = fit.problem.parameters[k];
    const double error = calibration.result.standard_errors(k);
    if (reasons[k].empty() && parameter.prior_sigma && error > 0.7 * *parameter.prior_sigma) {
      calibration.weak.push_back(parameter.name);
    }
  }
}

std::vector<IdentifiedParameter> identified_parameters(const discovery::SolverResult& result,
                                                       const std::vector<std::string>& reasons) {
  std::vector<IdentifiedParameter> identified;
  for (std::size_t k = 0; k < reasons.size(); ++k) {
    const double error = result.standard_errors(k);
    IdentifiedParameter entry{.name = result.parameters[k].name, .standard_error = {}, .state = reasons[k]};
    if (reasons[k].empty()) {
      entry.state = std::isfinite(error) ? "free" : "free, not identifiable";
      if (std::isfinite(error)) entry.standard_error = error;
    }
    identified.push_back(std::move(entry));
  }
  return identified;
}

// Root mean square of the residuals of points and distances over their degrees of freedom.
double left_per_coordinate(const discovery::SolverResult& result, const Measurements& measurements) {
  const std::vector<Eigen::Index> coordinates = measured_rows(measurements);
  const std::vector<Observation>& observations = measurements.poses.observations;
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t k = 0; k < coordinates.size(); ++k) {
    const bool turns = !observations.empty() && observations[coordinates[k] / 3].reading == Reading::orientation;
    if (turns) continue;
    squares += result.residuals(k) * result.residuals(k);
    count += 1.0;
  }
  const double all = static_cast<double>(coordinates.size());
  return std::sqrt(squares / std::max(1.0, count * (all - static_cast<double>(result.rank)) / all));
}

CalibrationRecord record_of(const Calibration& calibration, const Measurements& measurements) {
  CalibrationRecord record;
  std::set<Eigen::Index> stands;
  for (const Observation& seen : measurements.poses.observations) stands.insert(seen.stand);
  record.poses = stands.empty() ? measurements.count() : std::ssize(stands);
  record.coordinates = std::ssize(measured_rows(measurements));
  record.noise_mm = left_per_coordinate(calibration.result, measurements);
  std::vector<Eigen::Index> known;
  for (std::size_t k = 0; k < calibration.robot.identified.size(); ++k) {
    if (calibration.robot.identified[k].standard_error) known.push_back(static_cast<Eigen::Index>(k));
  }
  const Eigen::VectorXd errors = calibration.result.standard_errors(known);
  const Eigen::VectorXd inverse = errors.unaryExpr([](double error) { return error > 0.0 ? 1.0 / error : 0.0; });
  record.correlations = rows_of(columns_of(calibration.result.covariance, known), known);
  scale_rows(record.correlations, inverse);
  scale_columns(record.correlations, inverse);
  record.correlations = record.correlations.cwiseMin(1.0).cwiseMax(-1.0).eval();
  // Exactly symmetric, as the file has it.
  record.correlations = Eigen::MatrixXd(record.correlations.selfadjointView<Eigen::Lower>());
  record.correlations.diagonal().setOnes();
  return record;
}

Eigen::VectorXd start_values(const discovery::LeastSquaresProblem& problem) {
  Eigen::VectorXd values(std::ssize(problem.parameters));
  for (std::size_t k = 0; k < problem.parameters.size(); ++k) {
    values(k) = problem.parameters[k].value;
  }
  return values;
}

}  // namespace

discovery::SolverResult register_frames(Robot& robot, const Measurements& measurements,
                                        const CalibrationOptions& options) {
  validate(robot);
  validate(measurements, robot);
  const std::vector<discovery::Parameter> all = parameters(robot);
  std::vector<std::string> reasons = reasons_to_fix(robot, options);
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (!is_frame_parameter(all[k].name)) reasons[k] = "not a frame";
  }
  robot = with_started_frames(std::move(robot), measurements, reasons, options.solver);
  return fit_frames(robot, measurements, reasons, options.solver);
}

namespace {

// Adds the reasons that the poses give. Which geometry is of no use shows on the rigid arm: on one that bends, a
// combination that moves nothing when rigid moves loads, and would be identified from the thousandth part of an effect.
void fix_what_poses_do_not_tell(const Robot& robot, const Poses& poses, const std::vector<Eigen::Index>& rows,
                                double tolerance, std::vector<std::string>& reasons) {
  Robot rigid = robot;
  rigid.effects.clear();
  const Eigen::Index geometric = geometric_parameter_count(rigid.chain);
  std::vector<Eigen::Index> of_effects(reasons.size() - static_cast<std::size_t>(geometric));
  std::iota(of_effects.begin(), of_effects.end(), geometric);
  Eigen::MatrixXd jacobian(3 * poses.count(), std::ssize(reasons));
  jacobian.leftCols(geometric) = position_jacobian(rigid, poses);
  jacobian.rightCols(std::ssize(of_effects)) = position_jacobian(robot, poses, of_effects);
  jacobian = jacobian(rows, Eigen::all).eval();
  fix_dependent(parameters(robot), jacobian, geometric, tolerance, reasons);
}

Calibration calibrate_without_maps(const Robot& robot, const Measurements& measurements,
                                   const CalibrationOptions& options) {
  Calibration calibration;
  calibration.registered = robot;
  // The record of an earlier calibration, and a correction learnt from its residuals, hold no longer.
  calibration.registered.identified.clear();
  calibration.registered.calibration.reset();
  calibration.registered.correction_file.clear();
  if (!options.start_as_given) {
    calibration.registration = register_frames(calibration.registered, measurements, options);
  }
  calibration.robot = calibration.registered;
  discovery::LeastSquaresProblem problem = calibration_problem(calibration.robot, measurements);
  if (options.start_as_given) {
    calibration.registration.values = start_values(problem);
    calibration.registration.residuals = problem.residual(calibration.registration.values);
  }
  std::vector<std::string> reasons = reasons_to_fix(robot, options);
  fix_what_sockets_take_up(robot, measurements.poses, reasons);
  const auto fix_by = [&](const Poses& poses, std::vector<std::string>& all) {
    fix_what_poses_do_not_tell(calibration.registered, poses, measured_rows(measurements), options.dependence_tolerance,
                               all);
  };
  calibration.still = still_joints(robot.chain, measurements.poses);
  std::vector<std::string> moving = reasons;
  fix_by(measurements.poses, moving);
  if (calibration.still.empty()) {
    reasons = std::move(moving);
  } else {
    fix_by(with_still_joints_held(robot.chain, measurements.poses), reasons);
    for (std::size_t k = 0; k < reasons.size(); ++k) {
      if (moving[k].empty() && !reasons[k].empty()) reasons[k] = unseen_motion;
    }
  }
  keep_scale(calibration.registered, measurements.poses, options, reasons);
  problem.jacobian = free_derivatives(calibration.registered, measurements, reasons, false);
  identify(calibration, measurements, problem, reasons, options);
  calibration.robot.identified = identified_parameters(calibration.result, reasons);
  calibration.robot.calibration = record_of(calibration, measurements);
  for (std::size_t k = 0; k < reasons.size(); ++k) {
    if (!reasons[k].empty()) calibration.fixed.push_back({problem.parameters[k].name, reasons[k]});
  }
  return calibration;
}

}  // namespace

Calibration calibrate(const Robot& robot, const Measurements& measurements, const CalibrationOptions& options) {
  const Unmapped plain = unmapped(with_frames(robot, measurements.poses), measurements);
  Calibration calibration = calibrate_without_maps(plain.robot, plain.measurements, options);
  calibration.robot.calibration->joint_ranges = joint_ranges_of(robot.chain, measurements.poses);
  calibration.robot.calibration->condition_ranges = condition_ranges_of(robot.chain, measurements.poses);
  for (Robot* fitted : {&calibration.robot, &calibration.registered}) {
    fitted->effects.insert(fitted->effects.end(), plain.maps.begin(), plain.maps.end());
  }
  return calibration;
}

Robot with_placed_frames(const Robot& robot, const Measurements& measurements, const Poses& known) {
  std::set<std::string> frames;
  const auto visit = [](const Poses& poses, const auto& take) {
    if (poses.observations.empty() && poses.count() > 0) take(Observation{});
    for (const Observation& seen : poses.observations) take(seen);
  };
  const auto base_of = [](const Observation& seen) { return seen.base.empty() ? "base" : "base@" + seen.base; };
  const auto tool_of = [](const Observation& seen) { return seen.tool.empty() ? "tool" : "tool@" + seen.tool; };
  visit(measurements.poses, [&](const Observation& seen) { frames.insert({base_of(seen), tool_of(seen)}); });
  visit(known, [&](const Observation& seen) {
    frames.erase(base_of(seen));
    frames.erase(tool_of(seen));
  });
  const Unmapped plain = unmapped(with_frames(robot, measurements.poses), measurements);
  if (frames.empty()) return with_frames(robot, measurements.poses);
  CalibrationOptions options;
  options.only.assign(frames.begin(), frames.end());
  Robot placed = plain.robot;
  register_frames(placed, plain.measurements, options);
  placed.effects.insert(placed.effects.end(), plain.maps.begin(), plain.maps.end());
  return placed;
}

}  // namespace llmt::robotics
