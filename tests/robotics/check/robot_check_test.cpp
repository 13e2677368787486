#include "llmt/robotics/robot_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "check/f_tail.hpp"
#include "llmt/robotics/effects.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

constexpr double noise_mm = 0.02;

Robot arm() {
  Robot robot = read_robot(LLMT_ROBOTS_DIR "/tx200_like.yaml");
  robot.effects = {make_effect(effect_type("joint_compliance"), robot.chain, 1),
                   make_effect(effect_type("joint_compliance"), robot.chain, 2)};
  robot.effects[0].values = {2e-7};
  robot.effects[1].values = {3e-7};
  return robot;
}

Measurements measured(const Robot& robot, Eigen::Index poses, std::uint64_t seed) {
  return simulate(robot, {.poses = poses, .noise_um = 1e3 * noise_mm, .seed = seed});
}

CorrectedRobot calibrated(std::uint64_t seed) { return {calibrate(arm(), measured(arm(), 60, seed)).robot, {}}; }

// The arm on another day: the instrument somewhere else.
Robot another_day(Robot robot) {
  robot.chain.base = {{700.0, -300.0, 100.0}, {3.0, -2.0, 80.0}};
  return robot;
}

TEST(RobotCheck, NothingMovedIsSaidAtTheStatedRate) {
  int alarms_anew = 0;
  int alarms_same = 0;
  int no_longer_good = 0;
  constexpr int trials = 200;
  for (std::uint64_t trial = 1; trial <= trials; ++trial) {
    const CorrectedRobot robot = calibrated(trial);
    const RobotCheck anew = check_robot(robot, measured(another_day(arm()), 40, 1000 + trial));
    const RobotCheck same = check_robot(robot, measured(arm(), 40, 2000 + trial), {.same_session = true});
    alarms_anew += anew.moved.empty() ? 0 : 1;
    alarms_same += same.moved.empty() ? 0 : 1;
    no_longer_good += anew.still_good ? 0 : 1;
  }
  // At most 5 %: of 200 at most 10 are expected, and 10 + 3 sqrt(200 * 0.05 * 0.95) = 19.2.
  EXPECT_LE(alarms_anew, 19);
  EXPECT_LE(alarms_same, 19);
  EXPECT_LE(no_longer_good, 10);
}

const Moved* find_moved(const RobotCheck& check, const std::string& name) {
  for (const Moved& moved : check.moved) {
    if (moved.name == name || std::ranges::count(moved.or_else, name) > 0) return &moved;
  }
  return nullptr;
}

void expect_change(const Moved* moved, double by) {
  ASSERT_NE(moved, nullptr);
  EXPECT_NEAR(moved->changes.front().by, by, 4.5 * moved->changes.front().standard_error);
  EXPECT_GT(std::abs(by), 4.0 * moved->changes.front().standard_error);
}

// Far from the old tool its derivatives are others: those of the tool as it is now count.
TEST(RobotCheck, ATargetMountedElsewhereHidesNothing) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Robot changed = another_day(arm());
    changed.chain.tool.xyz_mm += Eigen::Vector3d(-50.0, 40.0, -40.0);
    const RobotCheck mounted = check_robot(calibrated(seed), measured(changed, 40, 300 + seed));
    EXPECT_TRUE(mounted.still_good);
    EXPECT_FALSE(mounted.unexplained);
    EXPECT_LT(mounted.refitted_mm, 1.1 * mounted.error.mean);
    changed.chain.joints[2].a_mm += 0.3;
    const RobotCheck grown = check_robot(calibrated(seed), measured(changed, 40, 400 + seed));
    expect_change(find_moved(grown, "joint3.a"), 0.3);
    EXPECT_LT(grown.refitted_mm, 1.2 * mounted.error.mean);
  }
}

TEST(RobotCheck, NamesAJointOffset) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Robot knocked = another_day(arm());
    knocked.chain.joints[2].theta_deg += 0.02;
    const RobotCheck check = check_robot(calibrated(seed), measured(knocked, 40, 100 + seed));
    ASSERT_EQ(check.moved.size(), 1U) << seed;
    EXPECT_EQ(check.moved[0].name, "joint3.theta");
    expect_change(find_moved(check, "joint3.theta"), 0.02);
    EXPECT_FALSE(check.still_good);
    EXPECT_LT(check.refitted_mm, 0.5 * check.error.mean);
  }
}

TEST(RobotCheck, NamesAChangedTool) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Robot bent = arm();
    bent.chain.tool.xyz_mm += Eigen::Vector3d(0.3, -0.2, 0.1);
    const RobotCheck same = check_robot(calibrated(seed), measured(bent, 40, 100 + seed), {.same_session = true});
    EXPECT_NE(find_moved(same, "tool"), nullptr) << seed;
    EXPECT_FALSE(same.still_good);
    const RobotCheck anew = check_robot(calibrated(seed), measured(another_day(bent), 40, 100 + seed));
    EXPECT_NE(find_moved(anew, "tool"), nullptr) << seed;
    EXPECT_TRUE(anew.still_good) << seed;  // the tool is fitted anew
  }
}

TEST(RobotCheck, NamesAChangedCompliance) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Robot softer = another_day(arm());
    softer.effects[0].values = {4e-7};
    const RobotCheck check = check_robot(calibrated(seed), measured(softer, 40, 100 + seed));
    expect_change(find_moved(check, "joint_compliance@joint2.compliance"), 2e-7);
  }
}

// Where the base is set up anew, an offset of the first joint is nowhere to be seen.
TEST(RobotCheck, SaysWhatItCannotSeeAndWhatCannotBeToldApart) {
  const RobotCheck anew = check_robot(calibrated(1), measured(another_day(arm()), 40, 5));
  EXPECT_EQ(std::ranges::count(anew.unseen, "joint1.theta"), 1);
  Robot turned = arm();
  turned.chain.joints[0].theta_deg += 0.05;
  const RobotCheck same = check_robot(calibrated(1), measured(turned, 40, 5), {.same_session = true});
  ASSERT_FALSE(same.moved.empty());
  EXPECT_NE(find_moved(same, "joint1.theta"), nullptr);
  EXPECT_NE(find_moved(same, "base.rz"), nullptr);
}

TEST(RobotCheck, SaysThatSomethingElseChanged) {
  Robot loose = another_day(arm());
  loose.effects.push_back(make_effect(effect_type("transmission_error"), loose.chain, 1));
  loose.effects.back().values = {3e-4, 0.0};
  const RobotCheck check = check_robot(calibrated(1), measured(loose, 60, 5));
  EXPECT_TRUE(check.unexplained);
  EXPECT_FALSE(check.still_good);
}

TEST(RobotCheck, AStatedAccuracyDecides) {
  const Measurements today = measured(another_day(arm()), 40, 5);
  EXPECT_TRUE(check_robot(calibrated(1), today, {.accuracy_mm = 1.0}).still_good);
  EXPECT_FALSE(check_robot(calibrated(1), today, {.accuracy_mm = 0.001}).still_good);
}

TEST(RobotCheck, RefusesWhatItCannotJudge) {
  const Measurements today = measured(arm(), 40, 5);
  EXPECT_THROW(check_robot({arm(), {}}, today), std::invalid_argument);  // not calibrated
  EXPECT_THROW(check_robot(calibrated(1), measured(arm(), 7, 5)), std::invalid_argument);
  EXPECT_THROW(check_robot(calibrated(1), today, {.level = 0.0}), std::invalid_argument);
  EXPECT_THROW(check_robot(calibrated(1), today, {.accuracy_mm = -1.0}), std::invalid_argument);
  CorrectedRobot old = calibrated(1);
  old.robot.calibration.reset();
  EXPECT_THROW(check_robot(old, today), std::invalid_argument);
  EXPECT_NO_THROW(check_robot(old, today, {.accuracy_mm = 0.1}));
}

TEST(RobotCheck, TheFileRemembersTheCalibration) {
  const CalibrationReport report = report_calibration(arm(), measured(arm(), 40, 1));
  const Robot& written = report.calibration.robot;
  const Robot read = parse_robot(to_yaml(written), "copy");
  ASSERT_TRUE(read.calibration);
  EXPECT_EQ(read.calibration->poses, 40);
  EXPECT_EQ(read.calibration->correlations, written.calibration->correlations);
  EXPECT_EQ(*read.calibration->held_out_mm, report.geometric.held_out_mm.mean());
  EXPECT_EQ(to_yaml(read), to_yaml(written));
}

// Against tables: F(0.95; 3, 10) = 3.708, F(0.99; 1, 30) = 7.562.
TEST(FTail, IsThatOfTheTables) {
  EXPECT_NEAR(f_tail(3.7083, 3, 10), 0.05, 1e-5);
  EXPECT_NEAR(f_tail(7.5625, 1, 30), 0.01, 1e-5);
  EXPECT_EQ(f_tail(0.0, 2, 5), 1.0);
  EXPECT_NEAR(f_tail(1.0, 5, 5), 0.5, 1e-12);
}

}  // namespace
}  // namespace llmt::robotics
