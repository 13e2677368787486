/// \file
/// What a calibration may change, and what is known of it beforehand.
///
///     CalibrationOptions options;
///     options.fixed = {"joint2.a", "tool"};
#pragma once

#include <map>
#include <string>
#include <vector>

#include "llmt/discovery/least_squares.hpp"

namespace llmt::robotics {

/// FixedParameter::why of the length that stands for the scale where all readings are of what the tool touches.
inline constexpr const char* unseen_scale = "no reading shows the scale";

/// A parameter that was not identified, and why.
struct FixedParameter {
  std::string name;
  std::string why;
};

/// FixedParameter::why of what only the motion of joints that hardly moved could tell.
inline constexpr const char* unseen_motion = "only the motion of joints that hardly moved could tell it";

/// A joint that hardly moved while the arm was measured: by less than 0.1 deg, or 1 mm of a prismatic joint.
struct StillJoint {
  std::string joint;
  std::string unit;    ///< deg or mm
  double range = 0.0;  ///< from the smallest to the largest value
};

struct CalibrationOptions {
  /// Parameters that keep their values: names ("joint2.a"), or owners of parameters ("base", "tool", "joint2",
  /// "joint_compliance@joint2").
  std::vector<std::string> fixed = {};
  /// If not empty, only these parameters are free, base and tool not excepted. Same spelling as `fixed`.
  std::vector<std::string> only = {};
  /// Consecutive axes within this angle count as nearly parallel: the Hayati angle beta is freed and d of that joint
  /// fixed.
  double parallel_axes_deg = 5.0;
  /// A parameter is fixed if its column of the Jacobian is a combination of earlier columns (base, tool, joints,
  /// effects) but for this share of its norm, or a thousandth if it belongs to an effect.
  double dependence_tolerance = 1e-5;
  /// Prior standard deviations of the lengths and angles of joints around their nominal values. Base and tool have ten
  /// times these, around the registered frames. The priors are weak: they matter only for parameters that the data
  /// hardly determine, such as the direction of a last axis on which the tool point lies, and keep those near nominal.
  /// 0: no prior.
  double prior_length_mm = 5.0;
  double prior_angle_deg = 1.0;
  /// Prior standard deviations of single parameters around their described values, in their own units; same spelling of
  /// names as `fixed`. They replace those above.
  std::map<std::string, double> priors = {};
  /// Standard deviations of what a position (mm, each coordinate) and an orientation (mrad, about each axis) are off
  /// from the calibrated model: noise and all that is not modelled. 0: from the residuals.
  double position_noise_mm = 0.0;
  double orientation_noise_mrad = 0.0;
  /// True: base and tool start at their values in the description instead of those of register_frames().
  bool start_as_given = false;
  discovery::SolverOptions solver = {};
};

}  // namespace llmt::robotics
