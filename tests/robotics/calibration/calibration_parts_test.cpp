// The parts of a calibration by themselves: priors, what is fixed, ranges, changes that undo a mistake.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "calibration/free_parameters.hpp"
#include "calibration/joint_ranges.hpp"
#include "calibration/suspected_changes.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/calibration_quality.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"

namespace llmt::robotics {
namespace {

constexpr double degrees_of_a_radian = 57.29577951308232;

Robot six_joints() { return read_robot(LLMT_ROBOTS_DIR "/tx200_like.yaml"); }

TEST(FreeParameters, AnOwnerIsWhatStandsBeforeTheLastDot) {
  EXPECT_EQ(owner_of("joint1.theta"), "joint1");
  EXPECT_EQ(owner_of("base@day.2.x"), "base@day.2");
}

// Where frames stand is known ten times less than the arm.
TEST(FreeParameters, PriorsOfFramesAreTenTimesThoseOfTheArm) {
  const Robot robot = six_joints();
  std::vector<discovery::Parameter> all = parameters(robot);
  CalibrationOptions options;
  options.prior_length_mm = 2.0;
  options.prior_angle_deg = 0.3;
  options.priors = {{"joint2.a", 7.0}};
  set_priors(all, geometric_parameter_count(robot.chain), options);
  const auto sigma = [&](const std::string& name) {
    return *std::ranges::find(all, name, &discovery::Parameter::name)->prior_sigma;
  };
  EXPECT_DOUBLE_EQ(sigma("base.x"), 20.0);
  EXPECT_DOUBLE_EQ(sigma("base.rz"), 3.0);
  EXPECT_DOUBLE_EQ(sigma("tool.z"), 20.0);
  EXPECT_DOUBLE_EQ(sigma("joint3.a"), 2.0);
  EXPECT_DOUBLE_EQ(sigma("joint1.theta"), 0.3);
  EXPECT_DOUBLE_EQ(sigma("joint2.a"), 7.0);
}

// Columns at right angles are kept whatever their size, all of them being small; a copy and a tiny one are not.
TEST(FreeParameters, WhatMovesNothingBesideTheOthersIsFixed) {
  std::vector<discovery::Parameter> all(4);
  for (std::size_t k = 0; k < 4; ++k) all[k].name = "joint1." + std::string(1, static_cast<char>('a' + k));
  for (discovery::Parameter& parameter : all) parameter.scale = 1.0;
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(8, 4);
  jacobian(0, 0) = 1e-9;
  jacobian(1, 1) = 2e-9;
  jacobian.col(2) = jacobian.col(0) + jacobian.col(1);
  jacobian(3, 3) = 1e-17;
  std::vector<std::string> reasons(4);
  fix_dependent(all, jacobian, 4, 1e-6, reasons);
  EXPECT_EQ(reasons[0], "");
  EXPECT_EQ(reasons[1], "");
  EXPECT_EQ(reasons[2], "not distinguishable from parameters before it");
  EXPECT_EQ(reasons[3], "does not move the measured point");
}

// The first joint turns about an axis that no socket tells from a turn of the base.
TEST(FreeParameters, SocketsTakeUpTheTurnOfTheFirstJointAlone) {
  const Robot robot = six_joints();
  Poses poses;
  poses.joints = Eigen::MatrixXd::Zero(2, 6);
  poses.observations = {{.base = "socket a"}, {.base = "socket b"}};
  ASSERT_TRUE(is_socket("socket a"));
  std::vector<std::string> reasons(parameters(robot).size());
  fix_what_sockets_take_up(robot, poses, reasons);
  for (std::size_t joint = 0; joint < 6; ++joint) {
    EXPECT_EQ(reasons[joint_parameter(joint, JointParameter::theta)].empty(), joint > 0) << joint;
  }
}

TEST(CalibratedRanges, EveryJointIsJudgedByItsOwn) {
  const Robot robot = six_joints();
  CalibrationRecord record;
  record.joint_ranges.assign(6, {-10.0, 10.0});
  Poses used;
  used.joints = Eigen::MatrixXd::Zero(2, 6);
  for (Eigen::Index j = 0; j < 6; ++j) {
    used.joints.row(1).setZero();
    used.joints(1, j) = 30.0 / degrees_of_a_radian;
    const std::vector<Beyond> beyond = beyond_calibrated(robot.chain, record, used);
    ASSERT_EQ(beyond.size(), 1U) << j;
    EXPECT_EQ(beyond[0].name, robot.chain.joints[j].name);
    EXPECT_NEAR(beyond[0].used_high, 30.0, 1e-9);
    EXPECT_EQ(beyond[0].rows, std::vector<Eigen::Index>{1});
  }
  record.joint_ranges.pop_back();
  EXPECT_THROW(beyond_calibrated(robot.chain, record, used), std::invalid_argument);
}

TEST(CalibratedRanges, ConditionsOfASinglePoseAreItsOwn) {
  Robot robot = six_joints();
  robot.chain.payload.mass_kg = 4.0;
  Poses poses;
  poses.joints = Eigen::MatrixXd::Zero(0, 6);
  EXPECT_TRUE(condition_ranges_of(robot.chain, poses).empty());
  poses.joints = Eigen::MatrixXd::Zero(1, 6);
  poses.covariates["temp_C"] = Eigen::VectorXd::Constant(1, 21.0);
  const auto ranges = condition_ranges_of(robot.chain, poses);
  EXPECT_EQ(ranges.at("payload_kg"), (std::array<double, 2>{4.0, 4.0}));
  EXPECT_EQ(ranges.at("temp_C"), (std::array<double, 2>{21.0, 21.0}));
}

// Each change undoes what it names, and nothing else.
TEST(SuspectedChanges, DoWhatTheyName) {
  const Robot robot = six_joints();
  Measurements before;
  before.poses.joints.resize(2, 6);
  before.poses.joints << 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, -0.3, 0.7, 0.2, -0.5, 0.9, 0.8;
  before.positions_mm.resize(2, 3);
  before.positions_mm << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0;
  const std::vector<Change> changes = single_changes(robot.chain, before.poses);
  const auto changed = [&](const std::string& name) {
    Measurements table = before;
    std::ranges::find(changes, name, &Change::name)->make(table);
    return table;
  };
  const Eigen::MatrixXd q = before.poses.joints;
  EXPECT_LT((changed("angles_radians").poses.joints - degrees_of_a_radian * q).norm(), 1e-12);
  EXPECT_LT((changed("angles_degrees").poses.joints - q / degrees_of_a_radian).norm(), 1e-12);
  EXPECT_EQ(changed("positions_metres").positions_mm, 1000.0 * before.positions_mm);
  EXPECT_EQ(changed("axes").positions_mm.col(0), before.positions_mm.col(1));
  Eigen::MatrixXd expected = q;
  expected.col(1) *= -1.0;
  EXPECT_EQ(changed("joint2_sign").poses.joints, expected);
  expected = q;
  expected.col(2) += q.col(1);
  EXPECT_EQ(changed("joint3_counted_with_joint2").poses.joints, expected);
  expected = q;
  expected.col(0) = q.col(5);
  expected.col(5) = q.col(0);
  EXPECT_EQ(changed("joint1_joint6_exchanged").poses.joints, expected);
  EXPECT_EQ(changed("joints_reversed").poses.joints, q.rowwise().reverse().eval());
}

// With the prior of a value that is nearly known, too, the closed form is what a calibration without the pose finds.
TEST(LeaveOneOut, CountsThePriors) {
  const Robot robot = six_joints();
  const Measurements seen = simulate(robot, {.poses = 30, .noise_um = 50.0, .seed = 3});
  CalibrationOptions options;
  options.prior_length_mm = 0.02;
  options.prior_angle_deg = 0.001;
  const Calibration all = calibrate(robot, seen, options);
  const Eigen::VectorXd closed = leave_one_out(all, seen);
  for (const Eigen::Index row : {0, 7, 29}) {
    const Calibration without = calibrate(robot, without_rows(seen, {static_cast<std::size_t>(row)}), options);
    const Eigen::VectorXd errors = distances(positions(without.robot, seen.poses), seen);
    EXPECT_NEAR(closed(row), errors(row), 0.05 * errors(row)) << row;
  }
}

// The root mean square of a coordinate over its degrees of freedom.
TEST(CalibrationParts, TheRecordedNoiseIsThatOfTheMeasurements) {
  const Robot robot = six_joints();
  const Calibration found = calibrate(robot, simulate(robot, {.poses = 60, .noise_um = 50.0, .seed = 4}));
  const double expected = 0.05;
  const double freedom = 180.0 - static_cast<double>(found.result.rank);
  EXPECT_NEAR(found.robot.calibration->noise_mm, expected, 4.0 * expected / std::sqrt(2.0 * freedom));
}

// Two readings of sixty that are centimetres off take most of the squares, with folds and without.
TEST(CalibrationParts, FarReadingsAreNamedWithoutFoldsToo) {
  const Robot robot = six_joints();
  Measurements seen = simulate(robot, {.poses = 60, .noise_um = 50.0, .seed = 5});
  seen.positions_mm(10, 0) += 30.0;
  seen.positions_mm(40, 1) -= 25.0;
  const auto has_far_readings = [&](int folds) {
    const CalibrationReport report = report_calibration(robot, seen, {.folds = folds});
    return far_readings(seen, report).has_value();
  };
  EXPECT_TRUE(has_far_readings(0));
  EXPECT_TRUE(has_far_readings(5));
}

}  // namespace
}  // namespace llmt::robotics
