// Likely mistakes of the user, and poses that the data do not cover, are noted beside what was found.
#include <gtest/gtest.h>

#include <algorithm>

#include "llmt/robotics/discovery/discovery.hpp"
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

TEST(InputMistakes, GravityAlongAnotherAxisIsGuessed) {
  Robot on_a_wall = soft(arm());
  on_a_wall.chain.gravity_m_s2 = {-9.81, 0.0, 0.0};
  const Discovery wrong = discover(arm(), seen(on_a_wall, 1), {}, {.correct = false});
  EXPECT_TRUE(mentions(wrong, about_gravity));
  EXPECT_TRUE(mentions(wrong, "along the x axis"));
  const Discovery right = discover(arm(), seen(soft(arm()), 1), {}, {.correct = false});
  EXPECT_EQ(right.answer, discovery::Answer::named);
  EXPECT_FALSE(mentions(right, about_gravity));
}

TEST(InputMistakes, PayloadsInGramsAreGuessed) {
  Measurements measurements = seen(soft(arm()), 2);
  measurements.poses.covariates["payload_kg"] = Eigen::VectorXd::LinSpaced(120, 0.0, 120.0);
  EXPECT_FALSE(mentions(discover(arm(), measurements, {}, {.correct = false}), "in grams"));
  measurements.poses.covariates["payload_kg"] *= 1000.0;
  EXPECT_TRUE(mentions(discover(arm(), measurements, {}, {.correct = false}), "is it in grams?"));
}

// Noise puts one effect in twenty beyond two standard errors of nothing: three or more of ten are left unsaid in one
// test of ninety.
TEST(InputMistakes, AnEffectThatTheDataDenyIsNamed) {
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

TEST(InputMistakes, TestPosesBeyondTheJointRangesSearchedAreCounted) {
  Robot narrow = soft(arm());
  narrow.chain.joints[1].limits = {{-20.0, 0.0}};
  const Measurements searched = seen(narrow, 4);
  const Discovery beyond = discover(arm(), searched, seen(soft(arm()), 5), {.correct = false});
  EXPECT_TRUE(mentions(beyond, "test poses lie outside of what was searched: joint2"));
  EXPECT_FALSE(
      mentions(discover(arm(), searched, seen(narrow, 6), {.correct = false}), "outside of what was searched"));
}

}  // namespace
}  // namespace llmt::robotics
