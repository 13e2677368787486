/// \file
/// What a calibration may change, and what is known of it beforehand.
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/least_squares.hpp"

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
  discovery::SolverOptions solver = {};
};

}  // namespace llmt::robotics
