#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"

namespace llmt::robotics {
namespace {

Robot tx200() { return read_robot(LLMT_ROBOTS_DIR "/tx200_like.yaml"); }

// The angle error of joint 3, a function of its angle in rad.
Measurements with_angle_error(const Robot& robot, double (*error)(double), std::uint64_t seed) {
  Measurements measurements = simulate(robot, {.poses = 120, .noise_um = 15.0, .seed = seed});
  Poses moved = measurements.poses;
  for (double& q : moved.joints.col(2)) q += error(q);
  measurements.positions_mm += positions(robot, moved) - positions(robot, measurements.poses);
  return measurements;
}

TEST(WaveHarmonics, ASawToothIsNoWaveOfAGearAndASineIs) {
  const auto saw = [](double q) { return 3e-4 * (7.3 * q - std::floor(7.3 * q) - 0.5); };
  const auto sine = [](double q) { return 1.5e-4 * std::sin(2.0 * std::numbers::pi * 7.3 * q); };
  const Discovery of_saw = discover(tx200(), with_angle_error(tx200(), saw, 7), {}, {.correct = false});
  EXPECT_EQ(of_saw.answer, discovery::Answer::unknown);
  EXPECT_TRUE(std::ranges::none_of(of_saw.effects, &FoundEffect::confirmed));
  const Discovery of_sine = discover(tx200(), with_angle_error(tx200(), sine, 7), {}, {.correct = false});
  EXPECT_EQ(of_sine.answer, discovery::Answer::named);
  ASSERT_EQ(of_sine.effects.size(), 1U);
  EXPECT_EQ(of_sine.effects[0].effect.type, "transmission_error");
  EXPECT_TRUE(of_sine.effects[0].confirmed);
}

}  // namespace
}  // namespace llmt::robotics
