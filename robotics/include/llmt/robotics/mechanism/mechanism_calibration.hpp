/// \file
/// Calibration of mechanisms, with an instrument that measures the output or by redundant sensors alone.
///
///     const Mechanism mechanism = read_mechanism("five_bar.yaml");
///     const MechanismTable measured = read_mechanism_table("measured.csv", mechanism);
///     const MechanismCalibration found = calibrate(mechanism, measured.values);
///     const double number = found.result.calibrability;  // cond2(J'J)
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/discovery/problem.hpp"
#include "llmt/folds.hpp"
#include "llmt/robotics/mechanism/mechanism.hpp"

namespace llmt::robotics {

/// Outcome of calibrate().
struct MechanismCalibration {
  Mechanism mechanism;  ///< with identified values and standard errors
  /// Its residuals are r of calibrate(), pose by pose; its sigma is the noise, as a multiple of noise_of().
  discovery::SolverResult result;
  Eigen::MatrixXd configurations;      ///< poses x coordinates: each adjusted to the equations; NaN if left out
  Eigen::MatrixXd corrections;         ///< poses x coordinates: what adjusts the readings to the equations, in units
  std::vector<Eigen::Index> left_out;  ///< poses that the described mechanism cannot take, ascending
  std::vector<std::string> reasons;    ///< of each
};

/// Identifies the parameters that are not fixed, from poses in which more is measured than the equations need.
///
/// Minimises the sum over poses of sum_i (v_i / sigma_i)^2, where v corrects the readings y of a pose such that
/// f(d, y + v, z) = 0 for some values z of what is not measured: the Gauss-Helmert model, or orthogonal distance
/// regression. Where readings of the outputs alone have noise, this is eq. (4) to (9) of the paper, with deviations in
/// units of the outputs. With N'df/dz = 0 and B = N' df/dy diag(sigma), the residual of a pose is
/// r = (B B')^(-1/2) N' f at the readings, to first order; |r|^2 is the sum above.
///
/// The branch of every pose is that of assemble(). It is chosen anew with the identified parameters, and these are
/// identified anew, as long as more poses can be taken or the sum falls.
///
/// `measured`: poses x coordinates, NaN where not measured. Throws std::invalid_argument as assemble(), if no pose has
/// a reading too many, and if readings that check each other are all exact.
MechanismCalibration calibrate(const Mechanism& mechanism, const Eigen::MatrixXd& measured);

/// How far a mechanism is off at poses.
struct MechanismErrors {
  /// True: `values` are measured minus predicted outputs (poses x coordinates, NaN elsewhere), where the outputs are
  /// predicted from the joints alone; of angles without whole turns that change no equation. False: the joints do not
  /// determine the outputs, or no output is measured, and `values` has one column, the root mean square of r of
  /// calibrate() per pose: the noise of the readings, as a multiple of noise_of(), that would explain why they
  /// contradict each other.
  bool of_outputs = false;
  Eigen::MatrixXd values;
};

/// Errors of the mechanism as it is described. NaN at a pose that it cannot take. Throws as calibrate().
MechanismErrors errors_of(const Mechanism& mechanism, const Eigen::MatrixXd& measured);

/// The poses whose readings contradict those of the others, ascending. Their error, see errors_of(), is beyond six
/// times the scale of its column, median |error| / 0.6745, at the parameters that the other poses tell: calibration
/// without them and this choice are repeated until the same poses are left out. Throws as errors_of().
std::vector<Eigen::Index> contradicting_poses(const Mechanism& mechanism, const Eigen::MatrixXd& measured);

/// Errors at poses that took no part in the calibration: each fold is calibrated without its held-out poses. Throws as
/// calibrate() and make_folds().
MechanismErrors held_out_errors(const Mechanism& mechanism, const Eigen::MatrixXd& measured, const FoldOptions& folds);

}  // namespace llmt::robotics
