/// \file
/// How well measurements determine a calibration, and where it may be trusted.
///
///     const Calibration calibration = calibrate(robot, measured);
///     const Eigen::VectorXd errors_mm = leave_one_out(calibration, measured);
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/observability.hpp"

namespace llmt::robotics {

/// Length of each reading's residual if its pose, with all its readings, had taken no part in the calibration; n
/// values, mm. First order in the parameters, without a refit: with J the Jacobian of the free parameters, each row
/// divided by its standard deviation, P the information of the priors and H = J (J'J + P)^-1 J', the residuals e of a
/// pose become (I - H_pose)^-1 e (Cook & Weisberg 1982, section 2.2.1). Exact where the model is linear; choices made
/// before, such as which parameters are free, keep what they saw of the pose.
Eigen::VectorXd leave_one_out(const Calibration& calibration, const Measurements& measurements);

/// Indices of the identification Jacobian of the free parameters at the calibrated values: rows over their standard
/// deviations, columns in parameter scales (1 mm, 0.1 deg).
Observability observability_of(const Calibration& calibration, const Measurements& measurements);

/// Noise of one coordinate as repeats show it: the pooled standard deviation of readings of the same pose (column
/// `pose`), target and session.
struct RepeatNoise {
  double sigma_mm = 0.0;
  Eigen::Index freedom = 0;  ///< number of repeats beyond the first of each pose
};
std::optional<RepeatNoise> noise_of_repeats(const Measurements& measurements);

/// Standard deviation of the model's position at each pose that comes from the parameters' covariance, mm: the square
/// root of the trace of J C J'. Combinations that no measurement determines count as known, and so do bases and tools
/// where `frames_are_known`: in another session they are fitted anew.
Eigen::VectorXd position_deviations(const Calibration& calibration, const Poses& poses, bool frames_are_known = false);

/// A joint or a condition that is used a tenth of its calibrated range or more beyond it. Ranges narrower than 5 kg and
/// 5 K count as that wide.
struct Beyond {
  std::string name;  ///< of the joint; payload, temperature
  std::string unit;  ///< deg, mm, kg, C
  double measured_low = 0.0;
  double measured_high = 0.0;
  double used_low = 0.0;
  double used_high = 0.0;
  std::vector<Eigen::Index> rows;  ///< of the poses of use that are beyond
};

/// By CalibrationRecord::joint_ranges and ::condition_ranges, joints first. A payload that the poses do not state is
/// that of the chain; a temperature that they do not state is not judged. Throws std::invalid_argument if there are
/// joint ranges, but not one for each joint.
std::vector<Beyond> beyond_calibrated(const Chain& chain, const CalibrationRecord& record, const Poses& used);

/// Rows in which anything is beyond its range, ascending.
std::vector<Eigen::Index> rows_beyond(const std::vector<Beyond>& beyond);

/// "joint2 from -90 to 120 deg, calibrated from -90 to 60 deg".
std::string to_string(const Beyond& beyond);

/// How poses of use lie to those that a calibration was made from.
struct Coverage {
  std::vector<Beyond> beyond;
  std::vector<Eigen::Index> outside;  ///< rows_beyond()
  double deviation_inside_mm = 0.0;   ///< root mean square of position_deviations() there; 0 if there are none
  double deviation_outside_mm = 0.0;
};
Coverage coverage(const Calibration& calibration, const Poses& measured, const Poses& used,
                  bool frames_are_known = false);

/// Mean error of calibrations to ever more poses, on poses that took no part.
struct LearningPoint {
  Eigen::Index poses = 0;
  double fitted_mm = 0.0;    ///< mean error on the poses of the calibrations
  double held_out_mm = 0.0;  ///< mean error on a fifth of all poses that none of them saw
};

/// At most eight sizes from 12 poses to four fifths of all, evenly spaced in their logarithm; each is the median of
/// `draws` random choices. Of several sessions the bases and tools are fitted to all poses before the error is taken.
/// Empty for fewer than 30 poses.
std::vector<LearningPoint> learning_curve(const Robot& robot, const Measurements& measurements,
                                          const CalibrationOptions& options = {}, int draws = 3,
                                          std::uint64_t seed = 1);

}  // namespace llmt::robotics
