/// \file
/// Identification of a robot's parameters from measured positions.
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

/// Why a parameter was not identified.
struct FixedParameter {
  std::string name;
  std::string why;
};

struct Calibration {
  Robot robot;       ///< identified; Robot::identified filled in
  Robot registered;  ///< as given, with base and tool alone fitted: the nominal robot in the measurement's frame
  discovery::SolverResult registration;  ///< of base and tool
  discovery::SolverResult result;        ///< of everything; residual norms count residuals in units of noise_mm
  double noise_mm = 0.0;  ///< standard deviation of one coordinate's residual, as used to weigh data against priors
  std::vector<std::string> weak;      ///< free parameters that the prior knows better than the data
  std::vector<FixedParameter> fixed;  ///< every parameter that was not free, in the order of parameters()
};

/// Fits base and tool, jointly and damped, everything else as given. The start comes in closed form (Kabsch 1976) from
/// several guesses of the tool. Parameters excluded by the options stay. Only positions are fitted: the tool's
/// orientation stays as given. Throws as calibrate().
discovery::SolverResult register_frames(Robot& robot, const Measurements& measurements,
                                        const CalibrationOptions& options = {});

/// Identifies base, tool, geometry and effects of a robot, in this order:
///
/// 1. register_frames();
/// 2. choice of the free parameters: theta, d, a, alpha of every joint, beta instead of d where axes are nearly
///    parallel, and all parameters of effects; a parameter that is exactly or nearly a combination of earlier ones over
///    the measured poses is fixed and reported;
/// 3. damped least squares over the free parameters (llmt::discovery::solve) with the weak priors of the options; the
///    residuals are divided by their standard deviation, which comes from the pass before.
///
/// Joint maps (effect `joint_map`) stay as they are and come last in the result: their values were smoothed, and least
/// squares would undo that. Only positions are fitted; measured orientations are not used.
/// Throws std::invalid_argument for wrong options, names that match no parameter, and measurements that do not suit the
/// robot.
Calibration calibrate(const Robot& robot, const Measurements& measurements, const CalibrationOptions& options = {});

/// The least-squares problem behind it: residuals model - measured over the measured coordinates, analytic Jacobian,
/// every parameter of parameters(robot) marked free. Robot and measurements are copied into it.
discovery::LeastSquaresProblem calibration_problem(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
