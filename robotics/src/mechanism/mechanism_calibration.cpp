#include "llmt/robotics/mechanism/mechanism_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "llmt/discovery/least_squares.hpp"
#include "llmt/outliers.hpp"
#include "mechanism/assembler.hpp"

namespace llmt::robotics {
namespace {

// The poses that take part, and the equations that they meet.
struct Poses {
  Equations equations;
  Eigen::MatrixXd known;
  Eigen::MatrixXd starts;
  Eigen::VectorXd sigma;
  std::vector<Eigen::Index> rows = {};  // of the table
  Eigen::VectorXd at = {};              // the parameters of `solved`
  std::vector<SolvedPose> solved = {};

  // Solves all poses, each from its start.
  void solve(const Eigen::VectorXd& parameters) {
    if (at.size() == parameters.size() && at == parameters) return;
    at = parameters;
    solved.clear();
    for (Eigen::Index row = 0; row < known.rows(); ++row) {
      solved.push_back(solve_pose(equations, parameters, known.row(row), sigma, starts.row(row)));
    }
  }

  // The solver asks for derivatives where it has arrived: further steps begin there, on the same branch.
  void start_here() {
    for (Eigen::Index row = 0; row < known.rows(); ++row) {
      if (solved[row].ok()) starts.row(row) = solved[row].coordinates.transpose();
    }
  }

  // The changes that adjust the readings to the equations, in their units.
  Eigen::MatrixXd corrections() const {
    Eigen::MatrixXd corrections = Eigen::MatrixXd::Zero(known.rows(), known.cols());
    for (Eigen::Index row = 0; row < known.rows(); ++row) {
      if (!solved[row].ok()) continue;
      const Eigen::RowVectorXd change = solved[row].coordinates.transpose() - known.row(row);
      corrections.row(row) = change.array().isFinite().select(change, 0.0);
    }
    return corrections;
  }

  Eigen::Index checks(Eigen::Index row) const {
    return equations.count() - std::ssize(kinds_of(known.row(row), sigma).unknown);
  }
};

Eigen::VectorXd stacked_residuals(Poses& poses, const Eigen::VectorXd& parameters) {
  poses.solve(parameters);
  Eigen::Index count = 0;
  for (Eigen::Index row = 0; row < poses.known.rows(); ++row) count += poses.checks(row);
  Eigen::VectorXd residuals(count);
  Eigen::Index next = 0;
  for (Eigen::Index row = 0; row < poses.known.rows(); ++row) {
    const Eigen::Index own = poses.checks(row);
    const SolvedPose& pose = poses.solved[row];
    residuals.segment(next, own) = pose.ok() ? pose.residual : Eigen::VectorXd::Constant(own, NAN);
    next += own;
  }
  return residuals;
}

Eigen::MatrixXd stacked_jacobian(Poses& poses, const Eigen::VectorXd& parameters) {
  const Eigen::Index count = stacked_residuals(poses, parameters).size();
  poses.start_here();
  Eigen::MatrixXd jacobian(count, parameters.size());
  Eigen::Index next = 0;
  for (Eigen::Index row = 0; row < poses.known.rows(); ++row) {
    const SolvedPose& pose = poses.solved[row];
    const Eigen::Index own = poses.checks(row);
    if (pose.ok()) {
      jacobian.middleRows(next, own) = pose.projection * poses.equations.by_parameters(parameters, pose.coordinates);
    } else {
      jacobian.middleRows(next, own).setConstant(NAN);
    }
    next += own;
  }
  return jacobian;
}

[[noreturn]] void refuse_calibration(const std::string& what) {
  throw std::invalid_argument("llmt::robotics::calibrate: " + what);
}

std::string first_of(const std::vector<std::string>& reasons) {
  return reasons.empty() ? ": there is none" : ", the first because: " + reasons.front();
}

Mechanism with_result(Mechanism mechanism, const discovery::SolverResult& result) {
  for (std::size_t k = 0; k < mechanism.parameters.size(); ++k) {
    MechanismParameter& parameter = mechanism.parameters[k];
    parameter.value = result.values(k);
    const double error = result.standard_errors(k);
    parameter.standard_error.reset();
    if (!parameter.fixed && std::isfinite(error)) parameter.standard_error = error;
  }
  return mechanism;
}

// Changes that move a point of a metre-long mechanism by about 1 mm.
double scale_of(const MechanismParameter& parameter) {
  if (parameter.unit == "mm") return 1.0;
  if (parameter.unit == "deg") return 0.1;
  return 1e-3 * std::max(1.0, std::abs(parameter.value));
}

// Priors are about the values of the description.
discovery::LeastSquaresProblem problem_of(const Mechanism& described, const Mechanism& start,
                                          const std::shared_ptr<Poses>& poses) {
  discovery::LeastSquaresProblem problem;
  for (std::size_t k = 0; k < described.parameters.size(); ++k) {
    const MechanismParameter& parameter = described.parameters[k];
    problem.parameters.push_back({.name = parameter.name,
                                  .unit = parameter.unit,
                                  .value = start.parameters[k].value,
                                  .scale = scale_of(parameter),
                                  .free = !parameter.fixed,
                                  .prior_sigma = parameter.prior_sigma,
                                  .prior_value = parameter.value});
  }
  problem.residual = [poses](const Eigen::VectorXd& values) { return stacked_residuals(*poses, values); };
  problem.jacobian = [poses](const Eigen::VectorXd& values) { return stacked_jacobian(*poses, values); };
  return problem;
}

// Priors weigh against the noise of the readings, which the fit tells: it is repeated until the noise has settled.
discovery::SolverResult solve_with_priors(discovery::LeastSquaresProblem problem) {
  constexpr int most_passes = 10;
  discovery::SolverResult result = discovery::solve(problem);
  const bool has_priors = std::ranges::any_of(problem.parameters, [](const discovery::Parameter& parameter) {
    return parameter.free && parameter.prior_sigma.has_value();
  });
  if (!has_priors) return result;
  double noise = 1.0;
  for (int pass = 0; pass < most_passes; ++pass) {
    const double now = noise * result.sigma;
    if (!(now > 0.0) || std::abs(now - noise) <= 0.01 * noise) break;
    noise = now;
    problem.weights = Eigen::VectorXd::Constant(result.residuals.size(), 1.0 / noise);
    for (std::size_t k = 0; k < problem.parameters.size(); ++k) problem.parameters[k].value = result.values(k);
    result = discovery::solve(problem);
  }
  result.sigma *= noise;
  return result;
}

// Poses that contradict the others: beyond the quantile of normal noise whose scale is that of the median pose, at
// which one pose in a hundred thousand would lie far off by chance.
std::vector<Eigen::Index> far_off(const std::vector<SolvedPose>& poses) {
  constexpr double by_chance = 1e-5;
  const auto share = [](const SolvedPose& pose, double probability) {
    const boost::math::chi_squared normal(static_cast<double>(pose.residual.size()));
    return pose.residual.squaredNorm() / boost::math::quantile(normal, probability);
  };
  const auto is_checked = [](const SolvedPose& pose) { return pose.ok() && pose.residual.size() > 0; };
  std::vector<double> variances;
  for (const SolvedPose& pose : poses) {
    if (is_checked(pose)) variances.push_back(share(pose, 0.5));
  }
  std::vector<Eigen::Index> far;
  if (variances.empty()) return far;
  const double variance =
      robust_scale(Eigen::Map<const Eigen::VectorXd>(variances.data(), std::ssize(variances))).median;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (is_checked(poses[i]) && share(poses[i], 1.0 - by_chance) > variance)
      far.push_back(static_cast<Eigen::Index>(i));
  }
  return far;
}

struct Fit {
  MechanismCalibration calibration;
  std::vector<Eigen::Index> far;  // poses that contradict the others
};

// The poses of an assembly that are solved from there with these parameters; the others fail in the assembly.
Poses poses_of(const Mechanism& described, const Eigen::VectorXd& parameters, const Eigen::MatrixXd& measured,
               Assembly& assembly) {
  Poses poses{.equations = Equations(described),
              .known = measured,
              .starts = assembly.coordinates,
              .sigma = noise_of(described, measured)};
  std::vector<Eigen::Index> taken;
  for (Eigen::Index row = 0; row < measured.rows(); ++row) {
    std::string& failure = assembly.failures[row];
    if (failure.empty()) {
      failure = solve_pose(poses.equations, parameters, measured.row(row), poses.sigma, assembly.coordinates.row(row))
                    .failure;
    }
    if (failure.empty()) taken.push_back(row);
  }
  poses.rows = taken;
  poses.known = measured(taken, Eigen::all);
  poses.starts = assembly.coordinates(taken, Eigen::all);
  return poses;
}

// Calibrates with the branch of every pose given; `start` has the parameters to begin with.
Fit fit_branches(const Mechanism& described, const Mechanism& start, const Eigen::MatrixXd& measured,
                 Assembly assembly) {
  MechanismCalibration calibration;
  const auto poses = std::make_shared<Poses>(poses_of(described, values_of(start), measured, assembly));
  for (Eigen::Index row = 0; row < measured.rows(); ++row) {
    if (assembly.failures[row].empty()) continue;
    calibration.left_out.push_back(row);
    calibration.reasons.push_back(assembly.failures[row]);
  }
  if (stacked_residuals(*poses, values_of(start)).size() == 0) {
    refuse_calibration(poses->rows.empty() ? "the mechanism can take none of the poses" + first_of(calibration.reasons)
                                           : "no reading checks another one: measure more than the equations need");
  }
  calibration.result = solve_with_priors(problem_of(described, start, poses));
  poses->solve(calibration.result.values);
  poses->start_here();
  calibration.configurations = Eigen::MatrixXd::Constant(measured.rows(), measured.cols(), NAN);
  calibration.configurations(poses->rows, Eigen::all) = poses->starts;
  calibration.corrections = Eigen::MatrixXd::Zero(measured.rows(), measured.cols());
  calibration.corrections(poses->rows, Eigen::all) = poses->corrections();
  calibration.mechanism = with_result(described, calibration.result);
  std::vector<Eigen::Index> far = far_off(poses->solved);
  for (Eigen::Index& row : far) row = poses->rows[row];
  return {std::move(calibration), std::move(far)};
}

Assembly without(Assembly assembly, const std::vector<Eigen::Index>& rows) {
  assembly.coordinates(rows, Eigen::all).setConstant(NAN);
  for (const Eigen::Index row : rows) assembly.failures[row] = "left out";
  return assembly;
}

// The next one takes more poses, or as many that contradict each other less.
bool is_better(const MechanismCalibration& next, const MechanismCalibration& present) {
  if (next.left_out.size() != present.left_out.size()) return next.left_out.size() < present.left_out.size();
  return next.result.residuals.squaredNorm() < (1.0 - 1e-6) * present.result.residuals.squaredNorm();
}

// Configurations of the same poses, NaN in rows without one.
bool are_same(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  constexpr double rounding = 1e-6;  // mm and degrees
  const auto differ = (a - b).array().abs() > rounding;
  return !differ.any() && (a.array().isNaN() == b.array().isNaN()).all();
}

}  // namespace

MechanismCalibration calibrate(const Mechanism& mechanism, const Eigen::MatrixXd& measured) {
  constexpr int most_passes = 10;
  Assembly assembly = assemble(mechanism, measured);
  Fit fit = fit_branches(mechanism, mechanism, measured, assembly);
  for (int pass = 0; pass < most_passes && fit.calibration.result.dof > 0; ++pass) {
    // The branch of a pose, and whether it can be taken, may show only where the parameters are better known. Poses on
    // a wrong branch spoil them, so these do without poses that contradict the others.
    assembly.coordinates = fit.calibration.configurations;
    const MechanismCalibration start =
        fit.far.empty()
            ? fit.calibration
            : fit_branches(mechanism, fit.calibration.mechanism, measured, without(assembly, fit.far)).calibration;
    try {
      assembly = assemble_again(start.mechanism, measured, start.configurations);
    } catch (const std::invalid_argument&) {
      break;  // readings that contradict the others have made a mechanism that its start values are far from
    }
    if (fit.far.empty() && are_same(assembly.coordinates, fit.calibration.configurations)) break;
    Fit next = fit_branches(mechanism, start.mechanism, measured, assembly);
    if (!is_better(next.calibration, fit.calibration)) break;
    fit = std::move(next);
  }
  return std::move(fit.calibration);
}

}  // namespace llmt::robotics
