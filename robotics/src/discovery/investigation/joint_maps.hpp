// Free maps of the joints: what is left as an angle error of each joint that depends on its own angle alone.
#pragma once

#include <optional>
#include <vector>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

struct JointMaps {
  std::vector<Effect> effects;     ///< of type joint_map
  std::vector<double> smoothness;  ///< chosen for each of them, relative to the data's information
  Eigen::VectorXd before;          ///< n: leave-one-out distances without the maps, mm
  Eigen::VectorXd after;           ///< n: with them
  double gain_in_errors = 0.0;     ///< mean of (before - after) over its standard error
};

/// Penalised least squares of the residuals on hat functions of every revolute joint's angle (and of a prismatic
/// joint's travel), with what its calibration freed of geometry and effects refitted to first order:
///   |r - C v|^2 + sum_j lambda_j |second differences of v_j|^2,
/// C the hats pushed through the joints' levers with the range of the Jacobian projected out; lambda_j from the
/// marginal likelihood (Wahba 1985). Leave-one-out distances are exact for the smoothness chosen. Nothing if no joint
/// moves.
std::optional<JointMaps> fit_joint_maps(const Robot& robot, const Measurements& measurements);

/// Of each column of displacements at the measured coordinates, the share of its sum of squares that maps of the joints
/// as smooth as these do not follow, beside a change of the geometry that the robot's calibration freed. The robot and
/// the measurements are those that the maps were fitted to.
Eigen::VectorXd beyond_maps(const Robot& robot, const Measurements& measurements, const JointMaps& maps,
                            const Eigen::MatrixXd& displacements);

}  // namespace llmt::robotics
