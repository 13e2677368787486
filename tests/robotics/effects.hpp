// What the tests of effects share: arms with weight, poses with every column, small helpers.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "robotics/robots.hpp"

namespace llmt::robotics {

/// The arm with masses, a payload and, where it says so, a base that stands crooked.
inline Robot weighted(Robot robot, bool crooked = true) {
  Random random(11);
  for (Joint& joint : robot.chain.joints) {
    joint.mass_kg = random.uniform(2.0, 30.0);
    for (double& value : joint.com_mm) value = random.uniform(-200.0, 200.0);
  }
  robot.chain.payload = {.mass_kg = 7.0, .com_mm = {20.0, -30.0, 50.0}};
  if (crooked) {
    robot.chain.base.xyz_mm = {100.0, -300.0, 500.0};
    robot.chain.base.rpy_deg = {20.0, -10.0, 70.0};
  }
  return robot;
}

/// Gravity across all axes, so that none is left without a load.
inline Robot slanted(Robot robot) {
  robot.chain.gravity_m_s2 = {3.0, -4.0, -8.0};
  return robot;
}

/// Random poses with all columns that any effect needs.
inline Poses furnished_poses(const Chain& chain, Eigen::Index n, std::uint64_t seed) {
  Poses poses = random_poses(chain, n, seed);
  Random random(seed + 1);
  const auto column = [&](const std::string& name, double lower, double upper) {
    Eigen::VectorXd values(n);
    for (double& value : values) value = random.uniform(lower, upper);
    poses.covariates[name] = values;
  };
  column("temp_C", 15.0, 30.0);
  column("payload_kg", 1.0, 9.0);
  column("order", 0.0, 100.0);
  column("time_s", 0.0, 3600.0);
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const std::string number = std::to_string(j + 1);
    const bool turns = chain.joints[j].type == JointType::revolute;
    column("tau" + number + "_Nm", -200.0, 200.0);
    column("dir" + number, -1.0, 1.0);
    poses.covariates["dir" + number] = poses.covariates["dir" + number].cwiseSign();
    column("qmeas" + number + (turns ? "_rad" : "_mm"), -1.0, 1.0);
  }
  add_moves(poses, chain);
  return poses;
}

inline Robot with_effect(Robot robot, Effect effect) {
  robot.effects.push_back(std::move(effect));
  return robot;
}

inline double column_of(const Poses& poses, const std::string& name, Eigen::Index row) {
  return poses.covariates.at(name)(row);
}

/// Where the rigid arm puts its tool with one joint moved by `change`.
inline Eigen::Vector3d moved_tool(const Robot& robot, Eigen::VectorXd q, std::size_t joint, double change) {
  q(joint) += change;
  return forward(robot.chain, q).position_mm;
}

/// Weight of the links from `first` on and of the payload, and its moment about a point, by summing.
inline Load weight_beyond(const Robot& robot, const Eigen::VectorXd& q, double payload_kg, std::size_t first,
                          const Eigen::Vector3d& point) {
  const Skeleton skeleton = Kinematics(robot.chain).skeleton(q);
  const Eigen::Vector3d gravity = skeleton.base_rotation * robot.chain.gravity_m_s2;
  Load load;
  const auto add = [&](double mass, const Eigen::Vector3d& centre) {
    load.force_N += mass * gravity;
    load.moment_Nm += (1e-3 * (centre - point)).cross(mass * gravity);
  };
  for (std::size_t k = first; k < robot.chain.joints.size(); ++k) {
    add(robot.chain.joints[k].mass_kg, skeleton.body_centre[k]);
  }
  add(payload_kg, skeleton.payload_centre);
  return load;
}

/// Generalised gravity force of a joint as minus the slope of the potential energy: N m, or N for a prismatic joint.
inline double gravity_by_energy(const Robot& robot, Eigen::VectorXd q, double payload_kg, std::size_t joint) {
  const bool turns = robot.chain.joints[joint].type == JointType::revolute;
  const double step = turns ? 1e-5 : 1e-2;
  const auto energy = [&](double change) {
    Eigen::VectorXd moved = q;
    moved(joint) += change;
    const Skeleton skeleton = Kinematics(robot.chain).skeleton(moved);
    const Eigen::Vector3d gravity = skeleton.base_rotation * robot.chain.gravity_m_s2;
    double sum = -payload_kg * gravity.dot(skeleton.payload_centre);
    for (std::size_t k = 0; k < robot.chain.joints.size(); ++k) {
      sum -= robot.chain.joints[k].mass_kg * gravity.dot(skeleton.body_centre[k]);
    }
    return 1e-3 * sum;  // N m
  };
  return -(energy(step) - energy(-step)) / (2.0 * (turns ? step : 1e-3 * step));
}

}  // namespace llmt::robotics
