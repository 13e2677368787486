#include "llmt/robotics/mechanism_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "llmt/discovery/least_squares.hpp"
#include "mechanism/equations.hpp"
#include "mechanism/pose_solver.hpp"

namespace llmt::robotics {
namespace {

// The poses that take part, and the equations that they meet.
struct Poses {
  Equations equations;
  Eigen::MatrixXd known;
  Eigen::MatrixXd starts;
  Eigen::VectorXd sigma;
  Eigen::VectorXd at = {};  // the parameters of `solved`
  std::vector<SolvedPose> solved = {};

  // Solves all poses, each from its start, so that the result depends on the parameters alone.
  void solve(const Eigen::VectorXd& parameters) {
    if (at.size() == parameters.size() && at == parameters) return;
    at = parameters;
    solved.clear();
    for (Eigen::Index row = 0; row < known.rows(); ++row) {
      solved.push_back(solve_pose(equations, parameters, known.row(row), sigma, starts.row(row)));
    }
  }

  // What adjusts the readings to the equations, in their units.
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

// What moves a point of a metre-long mechanism by about 1 mm.
double scale_of(const MechanismParameter& parameter) {
  if (parameter.unit == "mm") return 1.0;
  if (parameter.unit == "deg") return 0.1;
  return 1e-3 * std::max(1.0, std::abs(parameter.value));
}

discovery::LeastSquaresProblem problem_of(const Mechanism& mechanism, const std::shared_ptr<Poses>& poses) {
  discovery::LeastSquaresProblem problem;
  for (const MechanismParameter& parameter : mechanism.parameters) {
    problem.parameters.push_back({.name = parameter.name,
                                  .unit = parameter.unit,
                                  .value = parameter.value,
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

// Root mean square of the residual of a pose.
double contradiction(const SolvedPose& pose) {
  if (!pose.ok() || pose.residual.size() == 0) return NAN;
  return std::sqrt(pose.residual.squaredNorm() / static_cast<double>(pose.residual.size()));
}

std::vector<Eigen::Index> measured_outputs(const Mechanism& mechanism, const Eigen::MatrixXd& measured) {
  std::vector<Eigen::Index> outputs;
  for (Eigen::Index i = 0; i < measured.cols(); ++i) {
    if (mechanism.coordinates[i].output && measured.col(i).array().isFinite().any()) outputs.push_back(i);
  }
  return outputs;
}

// Whether there are as many equations as coordinates that are not known when the outputs are not.
bool joints_tell_outputs(const Mechanism& mechanism, const Eigen::MatrixXd& measured) {
  Eigen::Index unknown = 0;
  for (Eigen::Index i = 0; i < measured.cols(); ++i) {
    if (mechanism.coordinates[i].output || !measured.col(i).array().isFinite().any()) ++unknown;
  }
  return unknown <= std::ssize(mechanism.equations);
}

}  // namespace

MechanismCalibration calibrate(const Mechanism& mechanism, const Eigen::MatrixXd& measured) {
  const Assembly described = assemble(mechanism, measured);
  MechanismCalibration calibration;
  std::vector<Eigen::Index> taken;
  for (Eigen::Index row = 0; row < measured.rows(); ++row) {
    if (described.failures[row].empty()) {
      taken.push_back(row);
    } else {
      calibration.left_out.push_back(row);
      calibration.reasons.push_back(described.failures[row]);
    }
  }
  const auto poses = std::make_shared<Poses>(Poses{.equations = Equations(mechanism),
                                                   .known = measured(taken, Eigen::all),
                                                   .starts = described.coordinates(taken, Eigen::all),
                                                   .sigma = noise_of(mechanism, measured)});
  const discovery::LeastSquaresProblem problem = problem_of(mechanism, poses);
  if (stacked_residuals(*poses, values_of(mechanism)).size() == 0) {
    refuse_calibration(taken.empty() ? "the mechanism can take none of the poses" + first_of(calibration.reasons)
                                     : "no reading checks another one: measure more than the equations need");
  }
  calibration.result = solve_with_priors(problem);
  calibration.corrections = Eigen::MatrixXd::Zero(measured.rows(), measured.cols());
  poses->solve(calibration.result.values);
  calibration.corrections(taken, Eigen::all) = poses->corrections();
  calibration.mechanism = with_result(mechanism, calibration.result);
  return calibration;
}

MechanismErrors errors_of(const Mechanism& mechanism, const Eigen::MatrixXd& measured) {
  const std::vector<Eigen::Index> outputs = measured_outputs(mechanism, measured);
  MechanismErrors errors{.of_outputs = !outputs.empty() && joints_tell_outputs(mechanism, measured), .values = {}};
  if (errors.of_outputs) {
    Eigen::MatrixXd joints = measured;
    joints(Eigen::all, outputs).setConstant(NAN);
    const Assembly predicted = assemble(mechanism, joints);
    errors.values = Eigen::MatrixXd::Constant(measured.rows(), measured.cols(), NAN);
    errors.values(Eigen::all, outputs) = (measured - predicted.coordinates)(Eigen::all, outputs);
    return errors;
  }
  const Assembly assembly = assemble(mechanism, measured);
  const Eigen::VectorXd sigma = noise_of(mechanism, measured);
  Equations equations(mechanism);
  const Eigen::VectorXd parameters = values_of(mechanism);
  errors.values = Eigen::MatrixXd::Constant(measured.rows(), 1, NAN);
  for (Eigen::Index row = 0; row < measured.rows(); ++row) {
    if (!assembly.failures[row].empty()) continue;
    errors.values(row, 0) =
        contradiction(solve_pose(equations, parameters, measured.row(row), sigma, assembly.coordinates.row(row)));
  }
  return errors;
}

MechanismErrors held_out_errors(const Mechanism& mechanism, const Eigen::MatrixXd& measured,
                                const FoldOptions& options) {
  MechanismErrors all;
  for (const Fold& fold : make_folds(measured.rows(), options)) {
    const MechanismCalibration calibration = calibrate(mechanism, measured(fold.train, Eigen::all));
    const MechanismErrors some = errors_of(calibration.mechanism, measured(fold.held_out, Eigen::all));
    if (all.values.size() == 0) all.values = Eigen::MatrixXd::Constant(measured.rows(), some.values.cols(), NAN);
    all.of_outputs = some.of_outputs;
    all.values(fold.held_out, Eigen::all) = some.values;
  }
  return all;
}

}  // namespace llmt::robotics
