#include "kinematics/mimics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>

#include "kinematics/units.hpp"

namespace llmt::robotics {

std::vector<Follower> followers_of(const Chain& chain) {
  std::vector<Follower> followers;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const Joint& joint = chain.joints[j];
    if (!joint.mimic) continue;
    followers.push_back({.joint = static_cast<Eigen::Index>(j),
                         .leader = static_cast<Eigen::Index>(joint_index(chain, joint.mimic->joint)),
                         .multiplier = joint.mimic->multiplier,
                         .offset = joint.mimic->offset / to_limit_unit(joint)});
  }
  return followers;
}

Eigen::VectorXd followed(const std::vector<Follower>& followers, Eigen::VectorXd q) {
  for (const Follower& f : followers) q(f.joint) = f.multiplier * q(f.leader) + f.offset;
  return q;
}

Eigen::Index drive_count(const Chain& chain) {
  return std::ranges::count_if(chain.joints, [](const Joint& joint) { return !joint.mimic; });
}

Eigen::MatrixXd with_mimics(const Chain& chain, Eigen::MatrixXd joints) {
  for (const Follower& f : followers_of(chain)) {
    joints.col(f.joint) = (f.multiplier * joints.col(f.leader).array() + f.offset).matrix();
  }
  return joints;
}

void limit_leaders(const std::vector<Follower>& followers, Eigen::VectorXd& low, Eigen::VectorXd& high) {
  for (const Follower& f : followers) {
    const double at_low = (low(f.joint) - f.offset) / f.multiplier;
    const double at_high = (high(f.joint) - f.offset) / f.multiplier;
    low(f.leader) = std::max(low(f.leader), std::min(at_low, at_high));
    high(f.leader) = std::min(high(f.leader), std::max(at_low, at_high));
    low(f.joint) = -std::numeric_limits<double>::infinity();
    high(f.joint) = std::numeric_limits<double>::infinity();
  }
}

JointRanges joint_ranges(const Chain& chain, const std::string& caller) {
  constexpr double any = std::numeric_limits<double>::infinity();
  JointRanges ranges;
  ranges.low.setConstant(std::ssize(chain.joints), -any);
  ranges.high = -ranges.low;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const Joint& joint = chain.joints[j];
    const bool turns = joint.type == JointType::revolute;
    if (!joint.limits && joint.mimic) continue;
    if (!joint.limits && !turns) {
      throw std::invalid_argument(fmt::format("{}: {} is prismatic and has no limits_mm", caller, joint.name));
    }
    const std::array<double, 2> limits = joint.limits.value_or(std::array<double, 2>{-180.0, 180.0});
    ranges.low(j) = limits[0] * (turns ? radians : 1.0);
    ranges.high(j) = limits[1] * (turns ? radians : 1.0);
  }
  limit_leaders(followers_of(chain), ranges.low, ranges.high);
  return ranges;
}

void lead(const std::vector<Follower>& followers, Eigen::MatrixXd& jacobian) {
  for (const Follower& f : followers) {
    jacobian.col(f.leader) += f.multiplier * jacobian.col(f.joint);
    jacobian.col(f.joint).setZero();
  }
}

}  // namespace llmt::robotics
