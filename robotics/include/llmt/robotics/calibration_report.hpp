/// \file
/// How good a calibration is, on the poses it was made from and on poses that took no part.
///
///     const CalibrationReport report = report_calibration(robot, measured, {.correct = true});
///     const double held_out_mm = report.geometric.held_out_mm.mean();
///     const CorrectedRobot best = report.best();
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/folds.hpp"
#include "llmt/progress.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/correction.hpp"

namespace llmt::robotics {

/// Figures of the distances between model and measurement, mm.
struct ErrorFigures {
  double mean = 0.0;
  double max = 0.0;
  double p95 = 0.0;  ///< 95 % of the poses are at most this far off
  double rms = 0.0;
};

/// Figures of n distances. Throws std::invalid_argument if n is 0.
ErrorFigures error_figures(const Eigen::VectorXd& distances_mm);

/// Keeps the mean of errors on poses left out, mm, and their standard deviation (over n - 1), for a later check.
/// Readings that lie far off (as for far_readings()) do not count.
void remember_errors(CalibrationRecord& record, const Eigen::VectorXd& left_out_mm);

struct ReportOptions {
  CalibrationOptions calibration = {};
  bool correct = false;  ///< learn a residual correction and judge it
  /// Of a tree of the correction. Its leaves are crisp; folds and threads are those below, intervals are not made.
  FitOptions correction = {};
  bool boost = false;  ///< the correction is a sum of trees, with the seed below and no other options
  int folds = 5;       ///< 0: no held-out figures
  FoldKind kind = FoldKind::random;
  int correction_folds = 5;  ///< for the correction's leaf count, within every fold; 0: as grown
  std::uint64_t seed = 1;
  int max_threads = 0;
  Progress progress = {};  ///< the steps are "all poses", "fold 1", ...
};

/// Distances between one of the three models and the measured points (or of measured distances), and the angles between
/// the model and the measured orientations. For a held-out one, base, tool, geometry, effects, the tree and its size
/// are fitted without that pose.
struct Stage {
  Eigen::VectorXd in_sample_mm;         ///< one of each of the position_rows()
  Eigen::VectorXd held_out_mm;          ///< the same, or empty
  Eigen::VectorXd in_sample_mrad = {};  ///< one of each of the orientation_rows()
  Eigen::VectorXd held_out_mrad = {};   ///< the same, or empty
};

struct CalibrationReport {
  Calibration calibration;               ///< from all poses
  std::optional<Correction> correction;  ///< learnt on all poses, whether it is kept or not
  Stage nominal;                         ///< base and tool registered, everything else as given
  Stage geometric;                       ///< calibrated
  std::optional<Stage> corrected;
  /// The correction lowers the held-out mean error by more than two standard errors of the gain; without folds it is
  /// kept without being judged.
  bool correction_kept = false;
  std::string decision;  ///< the same in a sentence with the figures
  int folds = 0;
  bool grouped = false;  ///< rows of one pose were kept together, see pose_labels()
  std::vector<discovery::Termination> fold_terminations;

  /// The robot to use: calibrated, and corrected if the correction is kept.
  CorrectedRobot best() const;
};

/// Likely mistakes in description or measurements, which are no errors of the robot: poses beyond the
/// joint limits of the description; a mean error of more than a fiftieth of the arm's length, as wrong units, signs,
/// zeros or another robot give, before calibration or even after it; too few poses for the parameters; no gain on poses
/// left out. Empty: nothing looks wrong.
std::vector<Finding> input_mistakes(const Robot& robot, const Measurements& measurements,
                                    const CalibrationReport& report);

/// Names the readings, at most a twentieth of all (or three, of 24 or more), that lie more than eight times as far off
/// as the median and make a quarter of the squared error or more, by their lines; nothing if there are none. Where the
/// errors have a long tail, they are also farther than four standard deviations of lognormal errors with the median and
/// the 85 % quantile of these. calibrate_robustly() leaves such readings out.
std::optional<Finding> far_readings(const Measurements& measurements, const CalibrationReport& report);

/// Whether the calibrated robot still misses half of the measured points by more than a fiftieth of the nominal
/// machine's size_of(): the identified values mean nothing then.
bool is_implausible(const Robot& nominal, const Measurements& measurements, const CalibrationReport& report);

/// How large a machine is, as a measure of its errors, mm: the lengths of all links without the tool and the travel of
/// the slides in these poses. Where both are 0, as of a turntable: the root mean square distance of the measured points
/// from their mean.
double size_of(const Chain& chain, const Measurements& measurements);

/// Calibrates a robot, with the correction if asked for, on all poses and in every fold. Throws as calibrate() and
/// make_folds().
CalibrationReport report_calibration(const Robot& robot, const Measurements& measurements,
                                     const ReportOptions& options = {});

}  // namespace llmt::robotics
