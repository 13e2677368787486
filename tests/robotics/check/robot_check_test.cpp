#include "llmt/robotics/robot_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "check/f_tail.hpp"
#include "llmt/robotics/effects.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/check/checked_arm.hpp"
#include "robotics/robots.hpp"
#include "study.hpp"

namespace llmt::robotics {
namespace {

using checked::another_day;
using checked::arm;
using checked::calibrated;
using checked::measured;
using checked::noise_mm;
constexpr double radians = 0.017453292519943295;  // in one degree

TEST(RobotCheck, NothingMovedIsSaidAtTheStatedRate) {
  int alarms_anew = 0;
  int alarms_same = 0;
  int no_longer_good = 0;
  const int trials = sampled(200, 50);
  for (std::uint64_t trial = 1; trial <= static_cast<std::uint64_t>(trials); ++trial) {
    const CorrectedRobot robot = calibrated(trial);
    const RobotCheck anew = check_robot(robot, measured(another_day(arm()), 40, 1000 + trial));
    const RobotCheck same = check_robot(robot, measured(arm(), 40, 2000 + trial), {.same_session = true});
    alarms_anew += anew.moved.empty() ? 0 : 1;
    alarms_same += same.moved.empty() ? 0 : 1;
    no_longer_good += anew.still_good ? 0 : 1;
  }
  // At most 5 %: of 200 at most 10 are expected, and three standard deviations more are 19.2.
  const double expected = 0.05 * trials;
  const double most = expected + 3.0 * std::sqrt(0.95 * expected);
  EXPECT_LE(alarms_anew, most);
  EXPECT_LE(alarms_same, most);
  EXPECT_LE(no_longer_good, expected);
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
  EXPECT_EQ(read.calibration->joint_ranges, written.calibration->joint_ranges);
  EXPECT_EQ(read.calibration->correlations, written.calibration->correlations);
  EXPECT_EQ(*read.calibration->held_out_mm, report.geometric.held_out_mm.mean());
  EXPECT_EQ(to_yaml(read), to_yaml(written));
}

// Poses with the second joint in a range of degrees.
Measurements measured_within(Robot robot, double low, double high, Eigen::Index poses, std::uint64_t seed) {
  robot.chain.joints[1].limits = {low, high};
  return measured(robot, poses, seed);
}

Measurements one_after_the_other(Measurements first, const Measurements& second) {
  const auto stack = [](const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    Eigen::MatrixXd all(a.rows() + b.rows(), a.cols());
    all << a, b;
    return all;
  };
  first.poses.joints = stack(first.poses.joints, second.poses.joints);
  first.positions_mm = stack(first.positions_mm, second.positions_mm);
  return first;
}

// The second joint errs beyond 60 degrees, where nobody looked.
Robot bent_beyond() {
  Robot real = arm();
  real.effects.push_back(
      {.type = "joint_map", .at = "joint2", .values = {0.0, 6e-4}, .constants = {60.0 * radians, 0.35}});
  return real;
}

TEST(RobotCheck, WhatOnlyUncoveredPosesSayHasNotMoved) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const CorrectedRobot robot = {calibrate(arm(), measured_within(bent_beyond(), -60.0, 60.0, 60, seed)).robot, {}};
    Robot today = another_day(bent_beyond());
    const auto seen_today = [&] {
      return one_after_the_other(measured_within(today, -60.0, 60.0, 35, 100 + seed),
                                 measured_within(today, 85.0, 110.0, 10, 200 + seed));
    };
    const CheckOptions stated{.accuracy_mm = 4.0 * noise_mm};
    const RobotCheck same = check_robot(robot, seen_today(), stated);
    ASSERT_EQ(same.uncovered.size(), 10U);
    for (std::size_t k = 0; k < 10; ++k) EXPECT_EQ(same.uncovered[k], 35 + static_cast<Eigen::Index>(k));
    ASSERT_EQ(same.beyond.size(), 1U);
    EXPECT_EQ(same.beyond[0].name, "joint2");
    EXPECT_NEAR(same.beyond[0].measured_high, 60.0, 8.0);
    EXPECT_TRUE(same.moved.empty()) << seed;
    EXPECT_FALSE(same.moved_beyond.empty()) << seed;
    EXPECT_FALSE(same.still_good);
    EXPECT_TRUE(same.good_where_covered);
    // What the covered poses show, too, has moved.
    today.chain.joints[2].theta_deg += 0.02;
    const RobotCheck knocked = check_robot(robot, seen_today(), stated);
    expect_change(find_moved(knocked, "joint3.theta"), 0.02);
    EXPECT_FALSE(knocked.good_where_covered);
  }
}

TEST(RobotCheck, TooFewCoveredPosesDecideNothing) {
  const CorrectedRobot robot = {calibrate(arm(), measured_within(bent_beyond(), -60.0, 60.0, 60, 1)).robot, {}};
  const RobotCheck check = check_robot(robot, one_after_the_other(measured_within(bent_beyond(), -60.0, 60.0, 7, 2),
                                                                  measured_within(bent_beyond(), 85.0, 110.0, 30, 3)));
  EXPECT_TRUE(check.too_few_covered);
  EXPECT_TRUE(check.moved.empty());
  EXPECT_FALSE(check.moved_beyond.empty());
}

TEST(RobotCheck, WithoutRangesAllPosesAreJudged) {
  CorrectedRobot robot = {calibrate(arm(), measured_within(bent_beyond(), -60.0, 60.0, 60, 1)).robot, {}};
  ASSERT_EQ(robot.robot.calibration->joint_ranges.size(), 6U);
  robot.robot.calibration->joint_ranges.clear();
  const RobotCheck check = check_robot(robot, one_after_the_other(measured_within(bent_beyond(), -60.0, 60.0, 35, 2),
                                                                  measured_within(bent_beyond(), 85.0, 110.0, 10, 3)));
  EXPECT_FALSE(check.has_ranges);
  EXPECT_FALSE(check.moved.empty());
}

TEST(RobotCheck, WrongRangesInAFileAreRefusedByLine) {
  const std::string text = to_yaml(calibrated(1).robot);
  const auto says = [&](const std::string& from, const std::string& to, const std::string& what) {
    std::string changed = text;
    const std::size_t at = changed.find(from, changed.find("joint_ranges"));
    ASSERT_NE(at, std::string::npos);
    changed.replace(at, from.size(), to);
    try {
      parse_robot(changed, "wrong.yaml");
      FAIL() << what;
    } catch (const std::runtime_error& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with("wrong.yaml:")) << error.what();
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  says("joint: joint1", "joint: joint2", "must be joint1 here");
  says("range_deg: [-", "range_deg: [900, -", "\"range_deg\"");
  const std::size_t first = text.find("- {joint: joint6", text.find("joint_ranges"));
  ASSERT_NE(first, std::string::npos);
  says(text.substr(first, text.find('\n', first) - first), "", "there are 5 ranges of 6 joints");
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
