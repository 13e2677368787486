// Arms that the tests share, and random poses for them.
#pragma once

#include <array>
#include <numbers>
#include <string>
#include <vector>

#include "llmt/random.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

inline constexpr double degree = std::numbers::pi / 180.0;

/// Joints by rows {alpha deg, a mm, d mm, theta deg}.
inline Robot make_robot(Convention convention, const std::vector<std::array<double, 4>>& rows) {
  Robot robot;
  robot.chain.name = "arm";
  robot.chain.convention = convention;
  for (const auto& row : rows) {
    Joint joint;
    joint.name = "joint" + std::to_string(robot.chain.joints.size() + 1);
    joint.alpha_deg = row[0];
    joint.a_mm = row[1];
    joint.d_mm = row[2];
    joint.theta_deg = row[3];
    robot.chain.joints.push_back(joint);
  }
  return robot;
}

/// A wrist-partitioned arm in standard DH with three parallel axes, tool off the last axis.
inline Robot ur_like() {
  Robot robot =
      make_robot(Convention::dh,
                 {{90, 0, 90, 0}, {0, -425, 0, 0}, {0, -392, 0, 0}, {90, 0, 110, 0}, {-90, 0, 95, 0}, {0, 0, 82, 0}});
  robot.chain.tool.xyz_mm = {30.0, -20.0, 60.0};
  return robot;
}

/// Craig's convention, shoulder and elbow parallel.
inline Robot mdh_like() {
  Robot robot = make_robot(
      Convention::mdh,
      {{0, 0, 642, 0}, {-90, 250, 0, -90}, {0, 950, 0, 90}, {90, 0, 800, 0}, {-90, 0, 0, 0}, {90, 0, 194, 0}});
  robot.chain.tool.xyz_mm = {40.0, 10.0, 100.0};
  return robot;
}

/// Seven revolute joints.
inline Robot seven_axes() {
  Robot robot = make_robot(Convention::dh, {{-90, 0, 300, 0},
                                            {90, 0, 0, 0},
                                            {-90, 45, 550, 0},
                                            {90, -45, 0, 0},
                                            {-90, 0, 300, 0},
                                            {90, 0, 0, 0},
                                            {0, 0, 60, 0}});
  robot.chain.tool.xyz_mm = {50.0, 20.0, 30.0};
  return robot;
}

/// A SCARA: two parallel revolute joints, a prismatic one, a revolute one.
inline Robot scara() {
  Robot robot = make_robot(Convention::dh, {{0, 400, 350, 0}, {180, 300, 0, 0}, {0, 0, 100, 0}, {0, 0, 50, 0}});
  robot.chain.joints[2].type = JointType::prismatic;
  robot.chain.joints[1].sign = -1.0;
  robot.chain.tool.xyz_mm = {60.0, 0.0, 20.0};
  return robot;
}

/// n uniform poses: +-2.5 rad, or 0 ... 200 mm.
inline Poses random_poses(const Chain& chain, Eigen::Index n, std::uint64_t seed) {
  Random random(seed);
  Poses poses;
  poses.joints.resize(n, std::ssize(chain.joints));
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < poses.joints.cols(); ++j) {
      const bool turns = chain.joints[j].type == JointType::revolute;
      poses.joints(i, j) = turns ? random.uniform(-2.5, 2.5) : random.uniform(0.0, 200.0);
    }
  }
  return poses;
}

/// What a perfect instrument with normal noise sees of a robot.
inline Measurements measure(const Robot& robot, const Poses& poses, double noise_mm, std::uint64_t seed) {
  Random random(seed);
  Measurements measurements;
  measurements.poses = poses;
  measurements.positions_mm = positions(robot, poses);
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    for (int axis = 0; axis < 3; ++axis) measurements.positions_mm(i, axis) += noise_mm * random.normal();
  }
  return measurements;
}

/// The robot with every geometric value moved by normal numbers of the given sizes (b left alone); base moved far.
inline Robot perturbed(Robot robot, double length_mm, double angle_deg, std::uint64_t seed) {
  Random random(seed);
  for (Joint& joint : robot.chain.joints) {
    joint.a_mm += length_mm * random.normal();
    joint.d_mm += length_mm * random.normal();
    joint.alpha_deg += angle_deg * random.normal();
    joint.theta_deg += angle_deg * random.normal();
    joint.beta_deg += angle_deg * random.normal();
  }
  for (int axis = 0; axis < 3; ++axis) {
    robot.chain.tool.xyz_mm(axis) += 5.0 * length_mm * random.normal();
    robot.chain.base.xyz_mm(axis) = random.uniform(-2000.0, 2000.0);
  }
  robot.chain.base.rpy_deg = {random.uniform(-180.0, 180.0), random.uniform(-80.0, 80.0),
                              random.uniform(-180.0, 180.0)};
  return robot;
}

}  // namespace llmt::robotics
