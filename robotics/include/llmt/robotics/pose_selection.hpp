/// \file
/// Which poses to measure for a calibration.
///
///     const PoseSelection selection = select_poses(robot, {}, {.count = 40});
///     const double expected_mm = selection.chosen.position_mm;  // after calibration
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/observability.hpp"
#include "llmt/robotics/pose_selection_options.hpp"

namespace llmt::robotics {

/// What a calibration with some poses is expected to reach.
struct PredictedCalibration {
  struct Parameter {
    std::string name;
    std::string unit;
    double standard_error = 0.0;
  };
  Observability observability;        ///< without priors, all identifiable columns, in the parameters' scales
  std::vector<Parameter> parameters;  ///< the identifiable ones
  double position_mm = 0.0;           ///< standard error of the tool position: root mean square over the poses of use
};

struct PoseSelection {
  Poses poses;                        ///< chosen, in the order to drive
  double travel_deg = 0.0;            ///< sum over the moves from pose to pose of the largest move of a joint
  PredictedCalibration chosen;        ///< with these poses, and those already measured
  PredictedCalibration random;        ///< with as many random ones instead: the median of 25 draws by position error
  double bound_mm = 0.0;              ///< no choice of as many poses has a smaller position_mm: see select_poses()
  std::vector<FixedParameter> fixed;  ///< not identifiable by any of the poses, or fixed by the options
  std::vector<std::string> left_out;  ///< effects that depend on columns which are not there: taken as known
};

/// Poses uniform within the joint limits (revolute joints without limits: +-180 deg); with a box those outside of it
/// are led to random points of it. Throws as select_poses().
Poses random_poses(const Robot& robot, Eigen::Index count, const std::optional<ToolBox>& box, std::uint64_t seed);

/// Chooses poses by exchange (Fedorov 1972): greedy start, then each pose in turn makes room for the candidate that
/// improves the criterion most, until none does. What each candidate would bring is computed from 3 x 3 matrices by a
/// rank-three update. Without given candidates the search begins with 1500 random poses, goes on among neighbours of
/// the chosen ones at falling distance, and so ends between any grid.
///
/// The model is that of calibrate(): derivatives at the description, parameters freed and fixed as there over all
/// candidates, the same weak priors, joint maps as they are, independent noise. With A the inverse of the information
/// matrix M of priors and poses and W the mean of J'J over the poses of use, position_mm^2 = tr(A W).
///
/// The bound: for a choice of weights with information M, no m poses have a smaller tr(A W) than
///
///     tr(A W)^2 / (tr(A W A P) + m max_x tr(J_x A W A J_x')),
///
/// P the information of priors and measured poses, x over candidates (without given ones: a search among neighbours of
/// the best). It follows from convexity, as the equivalence theorem of Kiefer and Wolfowitz (1960) does. The weights
/// are found by the multiplicative algorithm (Silvey, Titterington & Torsney 1978).
///
/// The poses are in the order of the nearest neighbour, by the largest move of a joint, from the start that makes the
/// whole way shortest. Collisions and what the instrument can see are not checked: candidates can be.
///
/// Throws std::invalid_argument for options out of range, an empty box, poses that do not suit the robot, fewer
/// coordinates than parameters, a prismatic joint without limits; std::runtime_error if no pose brings the tool into
/// the box or not enough poses keep the spacing.
PoseSelection select_poses(const Robot& robot, const PosePlan& plan = {}, const PoseSelectionOptions& options = {});

}  // namespace llmt::robotics
