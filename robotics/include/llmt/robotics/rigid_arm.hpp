/// \file
/// What of a calibrated robot those can take who know rigid geometry alone: controllers, URDF files, nominal arms.
///
///     const Chain for_controller = geometry_alone(read_corrected_robot("discovered.yaml")).chain;
#pragma once

#include <string>
#include <vector>

#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// Where the whole model, with effects and correction, puts the tool at `count` poses, uniform in the joint ranges of
/// its calibration (or else in the limits of the joints, or a turn). Conditions as with_needed_columns() has them.
/// Throws std::runtime_error, see position_refusal(), where the model has no position.
Measurements points_of_model(const CorrectedRobot& robot, Eigen::Index count = 300);

/// The nominal chain with the base and tool with which its tool comes nearest to points_of_model(): frames that were
/// identified beside another geometry are not its own.
Chain with_fitted_frames(Chain nominal, const CorrectedRobot& robot);

/// The chain with the parameters of `only` (as CalibrationOptions::only) fitted to points_of_model(), from base and
/// tool of the robot on.
Chain fitted_to_model(Chain start, const CorrectedRobot& robot, const std::vector<std::string>& only);

/// The robot without effects and correction, its identified geometry fitted anew to points_of_model(): identified
/// beside effects, it is not that of the arm which comes nearest without them. A robot without effects and correction
/// stays as it is.
Robot geometry_alone(const CorrectedRobot& robot);

}  // namespace llmt::robotics
