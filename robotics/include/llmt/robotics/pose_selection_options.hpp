/// \file
/// The criterion, the space and the plan of a choice of poses.
///
///     PoseSelectionOptions options{.count = 60, .spacing_deg = 10.0};
///     options.box = ToolBox{.lower_mm = {200.0, -500.0, 0.0}, .upper_mm = {900.0, 500.0, 800.0}};
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "llmt/abi.hpp"
#include "llmt/progress.hpp"
#include "llmt/robotics/calibration_options.hpp"
#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

/// The quantity that chosen poses make best. `position`: the variance of the calibrated arm's tool position, mean over
/// the poses of its use (I-optimal, also called V-optimal). `o1` ... `o5`: the index of Observability, weak priors
/// included.
enum class PoseCriterion { position, o1, o2, o3, o4, o5 };

/// The space in which the tool point may be, in the frame of the robot's base.
struct ToolBox {
  Eigen::Vector3d lower_mm;
  Eigen::Vector3d upper_mm;
};

struct PoseSelectionOptions {
  Eigen::Index count = 40;  ///< poses to choose, 1 ... 1000
  PoseCriterion criterion = PoseCriterion::position;
  std::optional<ToolBox> box = {};
  /// Two poses differ by at least this in one joint. Full turns do not count; 1 mm of a prismatic joint counts as the
  /// angle that it is seen at from the arm's reach. 0: a pose may be chosen twice.
  double spacing_deg = 5.0;
  double noise_mm = 0.05;  ///< standard deviation of a measured coordinate
  CalibrationOptions calibration = {};
  std::uint64_t seed = 1;
  Progress progress = {};  ///< the steps are "choosing poses", "moving poses", "looking for the best possible"
};

/// What to choose from and for; each may be empty.
struct PosePlan {
  Poses candidates;  ///< poses to choose from; empty: all poses within joint limits and box
  Poses measured;    ///< were measured already, and are used for the calibration too
  Poses use;         ///< where the position counts; empty: the candidates, or else joint limits and box
};

}  // namespace llmt::robotics
