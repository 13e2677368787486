/// \file
/// Whether a calibrated robot is still good, and what of it moved.
///
///     const RobotCheck check = check_robot({robot, {}}, measured);
///     if (!check.still_good && !check.moved.empty()) std::puts(check.moved[0].name.c_str());
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/robotics/calibration_quality.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/correction.hpp"

namespace llmt::robotics {

struct CheckOptions {
  /// True: instrument and target are where they were when the robot was calibrated. False: both were set up anew, so
  /// that base and tool are fitted to the new measurements before the error is judged.
  bool same_session = false;
  /// Mean error up to which the robot is good. Empty: that of the calibration, see check_robot().
  std::optional<double> accuracy_mm = {};
  double level = 0.05;  ///< probability that anything is said to have moved although nothing has; 0 ... 0.5
};

/// Something that is not where the calibration found it: a parameter, or all those of an effect, the tool or the base.
struct Moved {
  struct Change {
    std::string parameter;
    std::string unit;
    double by = 0.0;              ///< new minus calibrated, everything else that moved fitted with it
    double standard_error = 0.0;  ///< of the difference: both calibrations are uncertain
  };
  std::string name;  ///< "joint2.theta", "joint_compliance@joint2", "tool"
  std::vector<Change> changes;
  double probability = 0.0;          ///< of so large a change by chance, times the number of things that were tested
  std::vector<std::string> or_else;  ///< that would explain the measurements equally well
};

enum class CheckVerdict {
  still_good,           ///< the mean error is within the limit, and nothing moved
  moved_within_limits,  ///< the mean error is within the limit, but a parameter, or what is no parameter, changed
  no_longer_good        ///< the mean error is beyond the limit
};

/// "still good", "moved, within limits", "no longer good".
std::string to_string(CheckVerdict verdict);

/// How good a robot is over all good readings, and which of them the calibration covers.
struct CheckedError {
  ErrorFigures error;         ///< mm, over the new poses; base and tool fitted to them unless it is the same session
  Eigen::VectorXd errors_mm;  ///< distances, one for each row of RobotCheck::judged
  bool accuracy_is_of_noise = false;  ///< no error on poses left out was stored: from the noise of the poses fitted
  double accuracy_mm = 0.0;           ///< mean error that was stated, or that calibration had on poses left out
  double limit_mm = 0.0;              ///< mean error from which on the robot is no longer good
  bool still_good = false;
  bool has_ranges = false;  ///< the description has the joint ranges of the calibration
  /// Joints of new poses beyond those ranges. Where there are any, only the other poses decide on what moved.
  std::vector<Beyond> beyond;
  std::vector<Eigen::Index> uncovered;  ///< rows_beyond() of them
  bool too_few_covered = false;         ///< to say what moved: RobotCheck::moved is empty
};

/// A reading that the others contradict.
struct BadReading {
  Eigen::Index row = 0;   ///< of the measurements
  double error_mm = 0.0;  ///< its distance from the calibrated robot
};

struct RobotCheck : CheckedError {
  CheckVerdict verdict = CheckVerdict::still_good;
  std::vector<BadReading> bad;       ///< left out of everything else
  std::vector<Eigen::Index> judged;  ///< rows of the other readings
  ErrorFigures covered_error;        ///< mm, over the covered poses, base and tool fitted to them alone
  bool good_where_covered = false;   ///< still_good of the covered poses
  std::vector<Moved> moved_beyond;   ///< what the fit to all poses names, and the covered poses do not
  std::vector<Moved> moved;          ///< in the order in which they were found
  double refitted_mm = 0.0;          ///< mean error if what moved were identified anew
  double noise_mm = 0.0;             ///< standard deviation of a coordinate that no change of the parameters explains
  double noise_before_mm = 0.0;      ///< the same at calibration; 0: not known
  bool unexplained =
      false;                ///< noise_mm is larger beyond chance and by a third: something changed that is no parameter
  Eigen::Index tested = 0;  ///< number of parameters and groups
  std::vector<std::string> unseen;  ///< what the new poses do not show at all
  bool has_correlations = false;    ///< the description has those of its parameters
};

/// Judges a calibrated and maybe corrected robot by new measurements.
///
/// Bad readings. A reading is left out where the others contradict it whatever moved: with all parameters free, the
/// shift of its coordinates takes so much of the squares by chance once in a thousand checks (F tests, times the number
/// of readings; Rosner 1983). At most a fifth of the readings.
///
/// The error. Without options.same_session base and tool are fitted. The limit is accuracy_mm if stated. Otherwise it
/// is the mean error of the calibration on poses left out (or, if there were no folds, what its noise makes), times
/// 1.1, or plus 2.33 standard errors of the difference of two such means, whichever is larger.
///
/// What moved. To first order the residuals are J_s s + J (d - d_0) + noise: s the base (nothing in the same session),
/// d_0 the error of the calibrated parameters, whose covariance the description has, d their change. Every parameter
/// that was identified, or fixed because it is a combination of others, every effect, the tool and the base are tested
/// by generalised least squares with an F test, the noise being what no change of any parameter explains, but no less
/// than at calibration. A model that lacks something errs alike at like poses, which would look like a change:
/// residuals of points may correlate by share exp(-d / range), d the distance of the joint values, in so far as they
/// scatter less, with all parameters free, than at calibration (restricted maximum likelihood, Patterson and Thompson
/// 1971). The level is divided by the number of tests (Bonferroni); the most probable one by BIC is taken for moved,
/// fitted from then on, and the rest tested again, until none passes: Holm's order. Whatever explains the residuals as
/// well, up to 3.84 in chi square, is listed beside it. Joint maps are not tested. A tool of another session counts as
/// moved if it is not where it was.
///
/// Where it was calibrated. A calibration knows nothing of joint values beyond those that it saw: there, what it could
/// not determine looks like a change. Poses with a joint a tenth of its calibrated range or more beyond it are listed,
/// and what moved is decided by the other poses, with base and tool fitted to them alone. What only the fit to all
/// poses names stands apart.
///
/// The verdict. The mean error of all good readings decides whether the robot is good. Where the instrument was set up
/// anew a target that was mounted anew counts as no change.
///
/// Throws std::invalid_argument for options out of range, fewer than 8 poses (5 in the same session), a robot without
/// identified parameters or without a record of its accuracy, or measurements that do not suit the robot.
RobotCheck check_robot(const CorrectedRobot& robot, const Measurements& measurements, const CheckOptions& options = {});

}  // namespace llmt::robotics
