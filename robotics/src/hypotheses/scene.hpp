// What hypotheses are made for, and the residuals as seen by one joint.
#pragma once

#include <array>
#include <vector>

#include "llmt/robotics/robot.hpp"

namespace llmt::robotics {

/// What hypotheses are made for.
struct Scene {
  const Robot& robot;  ///< at the current estimates
  const Poses& poses;
  const Eigen::VectorXd& residuals;  ///< 3n: measured - model, zero where not measured
  std::array<bool, 3> measured;
  std::vector<Eigen::MatrixXd>
      lever;              ///< for each joint 3n x 1: motion of the tool by the joint, zero where not measured
  Eigen::MatrixXd loads;  ///< n x J: gravity_loads() of the robot
  double largest_load(std::size_t joint) const {
    return loads.col(static_cast<Eigen::Index>(joint)).cwiseAbs().maxCoeff();
  }
  Eigen::VectorXd clipped;  ///< residuals for scans: no sample is longer than some times the median
};

Scene make_scene(const Robot& robot, const Poses& poses, const Eigen::VectorXd& residuals,
                 const std::array<bool, 3>& measured);

/// The residuals projected on the motion by a joint: a function f of the joint's angle error removes
/// sum(along f)^2 / sum(weight f^2) of the sum of squares.
struct JointSignal {
  std::vector<Eigen::Index> rows;
  std::vector<double> along;
  std::vector<double> weight;
  std::vector<double> angle;
  double low = 0.0;
  double high = 0.0;
};

JointSignal joint_signal(const Scene& scene, std::size_t joint);

}  // namespace llmt::robotics
