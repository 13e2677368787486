// An arm that bends, measured on two days.
#pragma once

#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/effects.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"

namespace llmt::robotics::checked {

inline constexpr double noise_mm = 0.02;

inline Robot arm() {
  Robot robot = read_robot(LLMT_ROBOTS_DIR "/tx200_like.yaml");
  robot.effects = {make_effect(effect_type("joint_compliance"), robot.chain, 1),
                   make_effect(effect_type("joint_compliance"), robot.chain, 2)};
  robot.effects[0].values = {2e-7};
  robot.effects[1].values = {3e-7};
  return robot;
}

inline Measurements measured(const Robot& robot, Eigen::Index poses, std::uint64_t seed) {
  return simulate(robot, {.poses = poses, .noise_um = 1e3 * noise_mm, .seed = seed});
}

inline CorrectedRobot calibrated(std::uint64_t seed) { return {calibrate(arm(), measured(arm(), 60, seed)).robot, {}}; }

// The arm on another day: the instrument somewhere else.
inline Robot another_day(Robot robot) {
  robot.chain.base = {{700.0, -300.0, 100.0}, {3.0, -2.0, 80.0}};
  return robot;
}

}  // namespace llmt::robotics::checked
