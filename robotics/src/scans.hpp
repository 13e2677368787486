// Residuals as seen by one joint.
#pragma once

#include <vector>

#include "hypotheses.hpp"

namespace llmt::robotics {

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
