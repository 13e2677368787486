// Joints that follow others.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/robotics/chain.hpp"

namespace llmt::robotics {

/// Joints of a chain by number; the value of the follower is multiplier times that of the leader plus offset, rad or
/// mm.
struct Follower {
  Eigen::Index joint;
  Eigen::Index leader;
  double multiplier;
  double offset;
};

std::vector<Follower> followers_of(const Chain& chain);

/// Joint values of one pose with those of followers computed.
Eigen::VectorXd followed(const std::vector<Follower>& followers, Eigen::VectorXd q);

/// Narrows the ranges of leaders to what their followers allow; those of followers become infinite.
void limit_leaders(const std::vector<Follower>& followers, Eigen::VectorXd& low, Eigen::VectorXd& high);

/// Ranges from which poses are drawn, in rad and mm: limits, or else +-180 deg of a revolute joint. Those of followers
/// narrow the ranges of their leaders, and are infinite.
struct JointRanges {
  Eigen::VectorXd low;
  Eigen::VectorXd high;
};

/// Throws std::invalid_argument beginning with `caller` if a prismatic joint with a drive has no limits.
JointRanges joint_ranges(const Chain& chain, const std::string& caller);

/// Derivatives by joint values, a column each: those of leaders with what their followers do, those of followers zero.
void lead(const std::vector<Follower>& followers, Eigen::MatrixXd& jacobian);

}  // namespace llmt::robotics
