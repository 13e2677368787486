/// \file
/// What calibration leaves over, learnt as a function of the joint values.
///
///     const CorrectedRobot corrected{robot, fit_correction(robot, measured).model};
///     const Eigen::MatrixXd tool_mm = positions(corrected, measured.poses);
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/robotics/correction_model.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/urdf.hpp"

namespace llmt::robotics {

/// measured - model in the base frame of the chain, n x 3, mm: it turns with the robot when base and instrument are set
/// up anew. Coordinates that were not measured count as exact.
Eigen::MatrixXd residuals(const Robot& robot, const Measurements& measurements);

/// A calibrated robot and what is added to it, eq. (18)-(19) of Benes et al. 2022:
///   p(q) = p_robot(q) + R_world_base e(q),
/// e the prediction of a model with inputs q1, q2, ... (rad or mm) and outputs among dx_mm, dy_mm, dz_mm; a missing
/// output is zero. Where orientations or several targets were measured, the model has drx_rad, dry_rad, drz_rad as
/// well: the rotation vector r(q) in the base frame, which turns the tool, R(q) = exp(R_world_base r) R_robot(q). Every
/// component is clamped to the range of the residuals seen in training. Without that, a leaf fitted to poses that
/// hardly move a joint has a meaningless slope along it, and a pose that does move the joint would be corrected by
/// metres.
struct CorrectedRobot {
  Robot robot;
  std::optional<Correction> correction;  ///< empty: no correction
};

/// Grows one tree per output on the residuals (or one for all: FitOptions::growth). Outputs whose residuals are all
/// zero get none. Where a stand of the arm has several readings, its displacement and rotation are those of least
/// squares. `groups`: as TrainingData::groups, one a pose; where a stand has several readings, each stand is a group.
/// Throws std::invalid_argument as llmt::fit(), and for distances.
FitResult fit_correction(const Robot& robot, const Measurements& measurements, const FitOptions& options = {},
                         const std::vector<double>& groups = {}, const Progress& progress = {});

/// Fits a sum of trees to the residuals of each output in the same way, fit_boosted(): more accurate, and nobody reads
/// it. With fewer than `fewest_boosted_rows` different poses it is their mean. Throws as fit_correction().
BoostResult fit_boosted_correction(const Robot& robot, const Measurements& measurements,
                                   const BoostOptions& options = {}, const std::vector<double>& groups = {},
                                   const Progress& progress = {});

/// What an instrument would read, n x 3, mm, as positions() of a robot. Throws std::invalid_argument if the model's
/// inputs are not the robot's joints in their order, named q1_rad, q2_rad, ... (_mm if prismatic), or an output is none
/// of the six or there twice.
Eigen::MatrixXd positions(const CorrectedRobot& robot, const Poses& poses);

/// Tool poses in the world frame. Throws as positions().
std::vector<Pose> tool_poses(const CorrectedRobot& robot, const Poses& poses);

/// Reads the robot and, if it names one, its correction model; a relative path is relative to the robot file. Throws
/// std::runtime_error, whose message shows nothing of a file that is no model.
CorrectedRobot read_corrected_robot(const std::string& path, const UrdfLinks& links = {});

}  // namespace llmt::robotics
