/// \file
/// Identification of a robot's parameters from measured positions.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/discovery/least_squares.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/robot.hpp"

namespace llmt::robotics {

struct CalibrationOptions {
  /// Kept at their values: parameter names ("joint2.a"), or owners of parameters ("base", "tool", "joint2",
  /// "joint_compliance@joint2").
  std::vector<std::string> fixed = {};
  /// If not empty, these alone are free, base and tool included. Same spelling.
  std::vector<std::string> only = {};
  /// Consecutive axes within this angle count as nearly parallel: the Hayati angle beta is freed and d of that joint
  /// fixed.
  double parallel_axes_deg = 5.0;
  /// A parameter whose column is, up to this share, a combination of earlier columns (base, tool, joints, effects) is
  /// fixed.
  double dependence_tolerance = 1e-5;
  /// What is known beforehand of the true values, as standard deviations around the nominal ones: of joint lengths and
  /// angles. For base and tool, around the registered frames, ten times as much. So weak that it matters only for what
  /// the data hardly tell, such as the direction of a last axis that the tool point lies on; there it keeps parameters
  /// near nominal. 0: nothing is known.
  double prior_length_mm = 5.0;
  double prior_angle_deg = 1.0;
  /// Base and tool start where the robot has them, instead of where register_frames() puts them.
  bool start_as_given = false;
  discovery::Options solver = {};
};

/// Why a parameter was not identified.
struct FixedParameter {
  std::string name;
  std::string why;
};

struct Calibration {
  Robot robot;       ///< identified; Robot::identified filled in
  Robot registered;  ///< as given, with base and tool alone fitted: the nominal robot in the measurement's frame
  discovery::Result registration;  ///< of base and tool
  discovery::Result result;        ///< of everything; residual norms count residuals in units of noise_mm
  double noise_mm = 0.0;  ///< standard deviation of one coordinate's residual, as used to weigh data against priors
  std::vector<std::string> weak;      ///< free parameters that the prior knows better than the data
  std::vector<FixedParameter> fixed;  ///< every parameter that was not free, in the order of parameters()
};

/// Fits base and tool, jointly and damped, everything else as given. The start comes in closed form (Kabsch 1976) from
/// several guesses of the tool. Parameters excluded by the options stay. Only positions are fitted: the tool's
/// orientation stays as given. Throws as calibrate().
discovery::Result register_frames(Robot& robot, const Measurements& measurements,
                                  const CalibrationOptions& options = {});

/// Identifies base, tool, geometry and effects of a robot, in this order:
///
/// 1. register_frames();
/// 2. choice of the free parameters: theta, d, a, alpha of every joint, beta instead of d where axes are nearly
/// parallel, all parameters
///    of effects; what is exactly or nearly a combination of earlier parameters over the measured poses is fixed and
///    reported;
/// 3. damped least squares over all of them (llmt::discovery::solve), residuals divided by their standard deviation
/// (from a first pass),
///    with the weak priors of the options.
///
/// Maps of joints (effect `joint_map`) stay as they are and come last in the result: their values were smoothed, which
/// least squares would undo.
/// Only positions are fitted; measured orientations are not used yet.
/// Throws std::invalid_argument for wrong options, names that match no parameter, and measurements that do not suit the
/// robot.
Calibration calibrate(const Robot& robot, const Measurements& measurements, const CalibrationOptions& options = {});

/// The least-squares problem behind it: residuals model - measured over the measured coordinates, analytic Jacobian,
/// every parameter of parameters(robot) marked free. Robot and measurements are copied into it.
discovery::Problem calibration_problem(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
