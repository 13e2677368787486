// What the user got wrong, or did not cover, is said beside what was found.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "llmt/robotics/discovery.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"

namespace llmt::robotics {
namespace {

Robot arm() { return read_robot(LLMT_ROBOTS_DIR "/tx200_like.yaml"); }

Robot soft(Robot robot) {
  robot.effects = {{"joint_compliance", "joint2", {1.5e-6}}, {"joint_compliance", "joint3", {2e-6}}};
  return robot;
}

bool mentions(const Discovery& found, const std::string& words) {
  return std::ranges::any_of(found.notes,
                             [&](const std::string& note) { return note.find(words) != std::string::npos; });
}

Measurements seen(const Robot& truth, std::uint64_t seed) {
  return simulate(truth, {.poses = 120, .noise_um = 15.0, .seed = seed});
}

constexpr const char* about_gravity = "is gravity_m_s2 of the description right";

TEST(Doubts, GravityAlongAnotherAxisIsGuessed) {
  Robot on_a_wall = soft(arm());
  on_a_wall.chain.gravity_m_s2 = {-9.81, 0.0, 0.0};
  const Discovery wrong = discover(arm(), seen(on_a_wall, 1), {}, {.correct = false});
  EXPECT_TRUE(mentions(wrong, about_gravity));
  EXPECT_TRUE(mentions(wrong, "along the x axis"));
  const Discovery right = discover(arm(), seen(soft(arm()), 1), {}, {.correct = false});
  EXPECT_EQ(right.answer, discovery::Answer::named);
  EXPECT_FALSE(mentions(right, about_gravity));
}

TEST(Doubts, PayloadsInGramsAreGuessed) {
  Measurements measurements = seen(soft(arm()), 2);
  measurements.poses.covariates["payload_kg"] = Eigen::VectorXd::LinSpaced(120, 0.0, 120.0);
  EXPECT_FALSE(mentions(discover(arm(), measurements, {}, {.correct = false}), "in grams"));
  measurements.poses.covariates["payload_kg"] *= 1000.0;
  EXPECT_TRUE(mentions(discover(arm(), measurements, {}, {.correct = false}), "is it in grams?"));
}

// Noise puts one effect in twenty beyond two standard errors of nothing: three or more of ten are left unsaid in one
// test of ninety.
TEST(Doubts, AnEffectThatTheDataDenyIsNamed) {
  Robot described = soft(arm());
  described.effects.push_back({"backlash_approach", "joint1", {1e-4}});
  const Robot truth = soft(arm());
  int said = 0;
  for (std::uint64_t seed = 30; seed < 40; ++seed) {
    Measurements measurements = simulate(described, {.poses = 120, .noise_um = 15.0, .seed = 3});
    measurements.positions_mm = simulate(truth, measurements.poses, {.noise_um = 15.0, .seed = seed}).positions_mm;
    const Discovery found = discover(described, measurements, {}, {.correct = false});
    said += mentions(found, "The description has backlash_approach@joint1, but these poses put it at nothing") ? 1 : 0;
    EXPECT_FALSE(mentions(found, "The description has joint_compliance"));
  }
  EXPECT_GE(said, 8);
}

TEST(Doubts, TestPosesBeyondTheJointRangesSearchedAreCounted) {
  Robot narrow = soft(arm());
  narrow.chain.joints[1].limits = {{-20.0, 0.0}};
  const Measurements searched = seen(narrow, 4);
  const Discovery beyond = discover(arm(), searched, seen(soft(arm()), 5), {.correct = false});
  EXPECT_TRUE(mentions(beyond, "test poses lie outside of what was searched: joint2"));
  EXPECT_FALSE(
      mentions(discover(arm(), searched, seen(narrow, 6), {.correct = false}), "outside of what was searched"));
}

// The angle error of joint 3, a function of its angle in rad.
Measurements with_angle_error(const Robot& robot, double (*error)(double), std::uint64_t seed) {
  Measurements measurements = seen(robot, seed);
  Poses moved = measurements.poses;
  for (double& q : moved.joints.col(2)) q += error(q);
  measurements.positions_mm += positions(robot, moved) - positions(robot, measurements.poses);
  return measurements;
}

TEST(Doubts, ASawToothIsNoWaveOfAGearAndASineIs) {
  const auto saw = [](double q) { return 3e-4 * (7.3 * q - std::floor(7.3 * q) - 0.5); };
  const auto sine = [](double q) { return 1.5e-4 * std::sin(2.0 * std::numbers::pi * 7.3 * q); };
  const Discovery of_saw = discover(arm(), with_angle_error(arm(), saw, 7), {}, {.correct = false});
  EXPECT_EQ(of_saw.answer, discovery::Answer::unknown);
  EXPECT_TRUE(std::ranges::none_of(of_saw.effects, &FoundEffect::confirmed));
  const Discovery of_sine = discover(arm(), with_angle_error(arm(), sine, 7), {}, {.correct = false});
  EXPECT_EQ(of_sine.answer, discovery::Answer::named);
  ASSERT_EQ(of_sine.effects.size(), 1U);
  EXPECT_EQ(of_sine.effects[0].effect.type, "transmission_error");
  EXPECT_TRUE(of_sine.effects[0].confirmed);
}

}  // namespace
}  // namespace llmt::robotics
