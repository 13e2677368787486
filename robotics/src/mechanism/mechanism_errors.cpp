#include <cmath>

#include "llmt/robotics/mechanism/mechanism_calibration.hpp"
#include "mechanism/assembler.hpp"

namespace llmt::robotics {
namespace {

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

// True if there are as many equations as coordinates that are not known when the outputs are not.
bool joints_tell_outputs(const Mechanism& mechanism, const Eigen::MatrixXd& measured) {
  Eigen::Index unknown = 0;
  for (Eigen::Index i = 0; i < measured.cols(); ++i) {
    if (mechanism.coordinates[i].output || !measured.col(i).array().isFinite().any()) ++unknown;
  }
  return unknown <= std::ssize(mechanism.equations);
}

// `before`: see assemble_again().
MechanismErrors errors_from(const Mechanism& mechanism, const Eigen::MatrixXd& measured,
                            const Eigen::MatrixXd& before) {
  const std::vector<Eigen::Index> outputs = measured_outputs(mechanism, measured);
  MechanismErrors errors{.of_outputs = !outputs.empty() && joints_tell_outputs(mechanism, measured), .values = {}};
  if (errors.of_outputs) {
    Eigen::MatrixXd joints = measured;
    joints(Eigen::all, outputs).setConstant(NAN);
    const Assembly predicted = assemble_again(mechanism, joints, before);
    errors.values = Eigen::MatrixXd::Constant(measured.rows(), measured.cols(), NAN);
    errors.values(Eigen::all, outputs) = (measured - predicted.coordinates)(Eigen::all, outputs);
    for (const Eigen::Index i : turning_coordinates(mechanism)) {
      for (double& error : errors.values.col(i)) error -= whole_turns(error);
    }
    return errors;
  }
  const Assembly assembly = assemble_again(mechanism, measured, before);
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

}  // namespace

MechanismErrors errors_of(const Mechanism& mechanism, const Eigen::MatrixXd& measured) {
  return errors_from(mechanism, measured, {});
}

MechanismErrors held_out_errors(const Mechanism& mechanism, const Eigen::MatrixXd& measured,
                                const FoldOptions& options) {
  MechanismErrors all;
  for (const Fold& fold : make_folds(measured.rows(), options)) {
    const MechanismCalibration calibration = calibrate(mechanism, measured(fold.train, Eigen::all));
    // Poses held out are reached from those that were not.
    Eigen::MatrixXd before = Eigen::MatrixXd::Constant(measured.rows(), measured.cols(), NAN);
    before(fold.train, Eigen::all) = calibration.configurations;
    const MechanismErrors some = errors_from(calibration.mechanism, measured, before);
    if (all.values.size() == 0) all.values = Eigen::MatrixXd::Constant(measured.rows(), some.values.cols(), NAN);
    all.of_outputs = some.of_outputs;
    all.values(fold.held_out, Eigen::all) = some.values(fold.held_out, Eigen::all);
  }
  return all;
}

}  // namespace llmt::robotics
