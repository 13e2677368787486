/// \file
/// Identification of a robot's parameters from measured positions.
///
///     const Calibration calibration = calibrate(robot, measured);
///     save(calibration.robot, "calibrated.yaml");
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/discovery/least_squares.hpp"
#include "llmt/robotics/calibration_options.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/robot.hpp"

namespace llmt::robotics {

struct Calibration {
  Robot robot;       ///< with the identified values; Robot::identified is filled in
  Robot registered;  ///< the nominal robot in the frame of the measurements: only base and tool are fitted
  discovery::SolverResult registration;  ///< of the fit of base and tool
  discovery::SolverResult result;        ///< of the whole fit; its residual norms are in units of noise_mm
  double noise_mm = 0.0;  ///< standard deviation of one coordinate's residual, as used to weigh data against priors
  double orientation_noise_mrad = 0.0;  ///< the same of orientations about one axis; 0: none were fitted
  /// The description is so far off that the priors around it kept the fit from the minimum: it was begun again without
  /// them.
  bool began_without_priors = false;
  std::vector<std::string> weak;      ///< free parameters that the prior determines more closely than the data
  std::vector<FixedParameter> fixed;  ///< every parameter that was not free, in the order of parameters()
  std::vector<StillJoint> still;      ///< what only their motion tells was kept as described
};

/// Fits bases and tools together by damped least squares; all other parameters keep their values. The fit starts from
/// bases in closed form (Kabsch 1976) for several guesses of the tool. Parameters that the options fix are not changed.
/// The robot must have the frames of the measurements, see with_frames(). Throws as calibrate().
discovery::SolverResult register_frames(Robot& robot, const Measurements& measurements,
                                        const CalibrationOptions& options = {});

/// Identifies base, tool, geometry and effects of a robot, in this order:
///
/// 1. register_frames();
/// 2. choice of the free parameters: theta, d, a, alpha of every joint, beta instead of d where axes are nearly
///    parallel, and all parameters of effects; a parameter that is exactly or nearly a combination of earlier ones over
///    the measured poses is fixed and reported, and so is one that is such a combination while the joints that hardly
///    moved (Calibration::still) stand still;
/// 3. damped least squares over the free parameters (llmt::discovery::solve) with the weak priors of the options; the
///    residuals are divided by their standard deviation sigma, which comes from the pass before: one for positions (or
///    distances) and one for orientations. Where the file states sigmas of its readings (stated_sigma_mm()), they come
///    on top: sigma^2 = common^2 + stated^2.
///
/// Joint maps (effect `joint_map`) stay as they are and are not in the result, but last in the robot: their values were
/// smoothed, and least squares would undo that. Measured orientations take part where with_orientations() made rows of
/// them. Throws std::invalid_argument for wrong options, names that match no parameter, and measurements that do not
/// suit the robot.
Calibration calibrate(const Robot& robot, const Measurements& measurements, const CalibrationOptions& options = {});

struct RobustCalibration {
  Calibration calibration;
  std::vector<std::size_t> left_out;  ///< rows that it was made without, ascending
};

/// Calibrates; where some readings are off by more than four times the median, again without them, until the same ones
/// are left out: least squares with weights 0 and 1 and a scale from the data. At most two fifths are left out. Throws
/// as calibrate().
RobustCalibration calibrate_robustly(const Robot& robot, const Measurements& measurements,
                                     const CalibrationOptions& options = {});

/// The robot with bases and tools of these measurements that `known` does not name fitted to them; everything else
/// stays. For measurements of another session: empty poses know nothing.
Robot with_placed_frames(const Robot& robot, const Measurements& measurements, const Poses& known);

}  // namespace llmt::robotics
