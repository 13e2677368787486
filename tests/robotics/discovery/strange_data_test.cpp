// Data as strangers bring them: soft gears, small effects beside large ones, gross outliers, errors that are no noise.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/effects.hpp"
#include "robotics/found.hpp"

namespace llmt::robotics {
namespace {

using discovery::Answer;

DiscoveryOptions quick() {
  DiscoveryOptions options;
  options.correct = false;
  options.held_out_share = 0.0;
  return options;
}

// A light arm with masses that are known.
Robot light_arm() {
  Robot robot = ur_like();
  constexpr std::array<double, 6> masses = {3.7, 8.4, 2.3, 1.2, 1.2, 0.2};
  for (std::size_t j = 0; j < masses.size(); ++j) {
    robot.chain.joints[j].mass_kg = masses[j];
    robot.chain.joints[j].com_mm = {j == 1 ? 210.0 : j == 2 ? 180.0 : 0.0, 0.0, 20.0};
  }
  robot.chain.payload = {.mass_kg = 2.0, .com_mm = {0.0, 0.0, 30.0}};
  return robot;
}

Poses poses_of(const Chain& chain, Eigen::Index n, std::uint64_t seed) {
  Poses poses = furnished_poses(chain, n, seed);
  poses.covariates["order"] = Eigen::VectorXd::LinSpaced(n, 1.0, static_cast<double>(n));
  poses.covariates["time_s"] = 30.0 * poses.covariates["order"];
  add_moves(poses, chain);
  return poses;
}

Measurements measured_on(const Robot& truth, Eigen::Index n, double noise_mm, std::uint64_t seed) {
  return measure(truth, poses_of(truth.chain, n, seed), noise_mm, seed + 100);
}

bool names(const Discovery& found, const std::string& type, const std::string& at) {
  return std::ranges::any_of(found.effects, [&](const FoundEffect& one) {
    return one.confirmed && one.effect.type == type && one.effect.at == at;
  });
}

std::string kind(const Discovery& found) { return found.unknown.empty() ? "" : found.unknown[0].pattern.kind; }

TEST(StrangeData, ASmallStrainWaveGearIsPlausible) {
  const Robot truth = with_effect(light_arm(), {"joint_compliance", "joint5", {9e-4}});
  const Discovery found = discover(light_arm(), measured_on(truth, 80, 0.02, 1), {}, quick());
  EXPECT_TRUE(names(found, "joint_compliance", "joint5")) << testing::PrintToString(labels(found));
}

TEST(StrangeData, ASmallEffectBesideALargeOneIsNamedToo) {
  Robot truth = with_effect(light_arm(), {"joint_compliance", "joint2", {6e-5}});
  truth = with_effect(truth, {"transmission_error", "joint1", {4e-5, 0.0}, {160.0}});
  Robot described = light_arm();
  described.chain.joints[0].gear_ratio = 80.0;
  const Discovery found = discover(described, measured_on(truth, 150, 0.01, 2), {}, quick());
  EXPECT_TRUE(names(found, "joint_compliance", "joint2")) << testing::PrintToString(labels(found));
  EXPECT_TRUE(names(found, "transmission_error", "joint1")) << testing::PrintToString(labels(found));
  const auto small =
      std::ranges::find(found.effects, "transmission_error", [](const FoundEffect& one) { return one.effect.type; });
  ASSERT_NE(small, found.effects.end());
  EXPECT_LT(small->share, 0.01);
  EXPECT_TRUE(small->smaller);
}

TEST(StrangeData, GrossOutliersDoNotHideAnEffect) {
  const Robot truth = with_effect(ur_like(), {"joint_gain", "joint2", {4e-4}});
  for (const double size : {20.0, 500.0}) {
    Measurements measured = measured_on(truth, 60, 0.02, 3);
    for (const Eigen::Index row : {5, 17, 23, 41}) measured.positions_mm(row, row % 3) += size;
    measured.positions_mm.row(30).swap(measured.positions_mm.row(31));
    const Discovery found = discover(ur_like(), measured, {}, quick());
    EXPECT_NE(found.answer, Answer::nothing_missing) << size;
    EXPECT_TRUE(names(found, "joint_gain", "joint2"))
        << size << testing::PrintToString(labels(found)) << kind(found) << testing::PrintToString(found.notes)
        << testing::PrintToString(found.outliers) << found.noise_mm;
    std::vector<Eigen::Index> outliers = found.outliers;
    std::ranges::sort(outliers);
    EXPECT_EQ(outliers, (std::vector<Eigen::Index>{5, 17, 23, 30, 31, 41})) << size;
    EXPECT_LT(found.fitted_before.max, 2.0) << size;  // they are no error of the arm
    EXPECT_LT(found.fitted_after.max, 0.2) << size;
  }
}

TEST(StrangeData, TooManyOutliersAreNoAllClear) {
  Measurements measured = measured_on(ur_like(), 80, 0.02, 4);
  Random random(5);
  for (Eigen::Index row = 0; row < 80; row += 4) {
    for (int axis = 0; axis < 3; ++axis) measured.positions_mm(row, axis) += 2.0 * random.normal();
  }
  const Discovery found = discover(ur_like(), measured, {}, quick());
  EXPECT_EQ(found.answer, Answer::unknown);
  EXPECT_EQ(kind(found), "outliers");
}

TEST(StrangeData, ScatterOfOneJointIsNoInstrumentsNoise) {
  const Robot robot = ur_like();
  Measurements measured = measured_on(robot, 120, 0.01, 6);
  Random random(7);
  const Kinematics kinematics(robot.chain);
  for (Eigen::Index i = 0; i < measured.count(); ++i) {
    const Eigen::Vector3d lever = kinematics.joint_jacobian(measured.poses.joints.row(i).transpose()).col(1).head<3>();
    measured.positions_mm.row(i) += 2e-4 * random.normal() * lever.transpose();
  }
  const Discovery found = discover(robot, measured, {}, quick());
  EXPECT_EQ(found.answer, Answer::unknown);
  EXPECT_EQ(kind(found), "noise") << testing::PrintToString(labels(found));
  ASSERT_FALSE(found.unknown.empty());
  EXPECT_EQ(found.unknown[0].pattern.acts_on, "joint2");
}

// Trackers see angles worse than distances, and some see heights worse than the rest.
TEST(StrangeData, NoiseThatDiffersBetweenDirectionsIsNoise) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Robot robot = ur_like();
    robot.chain.base.xyz_mm = {2500.0, 800.0, -400.0};
    Measurements measured = measured_on(robot, 90, 0.0, 10 + seed);
    Random random(seed);
    for (Eigen::Index i = 0; i < measured.count(); ++i) {
      Eigen::RowVector3d noise(random.normal(), random.normal(), random.normal());
      if (seed % 2 == 0) {
        measured.positions_mm.row(i) += noise.cwiseProduct(Eigen::RowVector3d(0.01, 0.01, 0.04));
      } else {
        const Eigen::RowVector3d out = measured.positions_mm.row(i).normalized();
        measured.positions_mm.row(i) += 0.04 * (noise - noise.dot(out) * out) + 0.008 * noise.dot(out) * out;
      }
    }
    EXPECT_EQ(discover(robot, measured, {}, quick()).answer, Answer::nothing_missing) << seed;
  }
}

TEST(StrangeData, AnEccentricCircleOfTheInstrumentIsNamed) {
  Robot robot = ur_like();
  robot.chain.base.xyz_mm = {2500.0, 800.0, -400.0};
  const Robot truth = with_effect(robot, {"instrument_azimuth", "", {1.5e-4, -1e-4}});
  const Discovery found = discover(robot, measured_on(truth, 100, 0.01, 30), {}, quick());
  EXPECT_TRUE(names(found, "instrument_azimuth", "")) << testing::PrintToString(labels(found));
}

TEST(StrangeData, AJointReadBeforeItStoodStillIsNamed) {
  const Robot truth = with_effect(ur_like(), {"not_settled", "joint2", {2e-4}});
  const Discovery found = discover(ur_like(), measured_on(truth, 100, 0.02, 31), {}, quick());
  EXPECT_TRUE(names(found, "not_settled", "joint2")) << testing::PrintToString(labels(found));
}

TEST(StrangeData, BacklashWithASoftTransitionHasItsName) {
  const Robot truth = with_effect(light_arm(), {"backlash_gravity_soft", "joint3", {3e-4}, {0.6}});
  const Discovery found = discover(light_arm(), measured_on(truth, 120, 0.01, 32), {}, quick());
  ASSERT_FALSE(found.effects.empty());
  for (const FoundEffect& one : found.effects) {
    EXPECT_EQ(effect_type(one.effect.type).family, "backlash_gravity") << effect_label(one.effect);
    EXPECT_TRUE(one.confirmed);
  }
}

TEST(StrangeData, AWholeOrderIsTakenWhereItExplainsAsWell) {
  const Robot truth = with_effect(ur_like(), {"transmission_error", "joint2", {2e-4, 1e-4}, {5.0}});
  const Discovery found = discover(ur_like(), measured_on(truth, 100, 0.02, 33), {}, quick());
  EXPECT_EQ(labels(found), std::vector<std::string>{"transmission_error@joint2[5]"});
}

// 60 degrees called 60 rad, or the other way round, bends the fitted tool to metres.
TEST(StrangeData, PlausibilityIsMeasuredByTheNominalArm) {
  Measurements measured = measured_on(ur_like(), 80, 0.02, 34);
  measured.poses.joints *= degree;
  EXPECT_THROW(discover(ur_like(), measured, {}, quick()), std::runtime_error);
}

TEST(StrangeData, NamesThatMakeThePosesSetAsideWorseAreWithdrawn) {
  const Robot truth = with_effect(ur_like(), {"joint_gain", "joint2", {4e-4}});
  const Robot other = with_effect(ur_like(), {"joint_gain", "joint2", {-4e-4}});
  const Discovery found =
      discover(ur_like(), measured_on(truth, 80, 0.02, 35), measured_on(other, 40, 0.02, 36), quick());
  EXPECT_EQ(found.answer, Answer::unknown);
  EXPECT_TRUE(found.improved.robot.effects.empty());
  for (const FoundEffect& one : found.effects) EXPECT_FALSE(one.confirmed) << effect_label(one.effect);
}

// Derivatives that hold deformations constant are a hundredth off on an arm as soft as this one.
TEST(StrangeData, ADescriptionWithSoftJointsCalibratesToTheEnd) {
  Robot truth = light_arm();
  for (const char* joint : {"joint2", "joint3", "joint5"}) {
    truth = with_effect(truth, {"joint_compliance", joint, {4e-4}});
  }
  truth = with_effect(truth, {"link_bending", "joint2", {2e-5}});
  truth = with_effect(truth, {"elastic_base", "", {3e-5}});
  const Measurements measured = measured_on(truth, 80, 0.02, 37);
  const Calibration fitted = calibrate(truth, measured);
  EXPECT_TRUE(fitted.result.converged()) << fitted.result.reason;
  const Calibration again = calibrate(fitted.robot, measured);
  EXPECT_TRUE(again.result.converged()) << again.result.reason;
}

TEST(StrangeData, WhatIsRefusedForItsSizeIsMentioned) {
  const Robot truth = with_effect(light_arm(), {"elastic_base", "", {5e-4}});
  const Discovery found = discover(light_arm(), measured_on(truth, 80, 0.02, 21), {}, quick());
  EXPECT_FALSE(names(found, "elastic_base", ""));
  const auto base = std::ranges::find(found.beyond_plausible, "elastic_base",
                                      [](const BeyondPlausible& one) { return one.effect.type; });
  ASSERT_NE(base, found.beyond_plausible.end());
  EXPECT_NEAR(base->parameter.value, 5e-4, 1e-4);
  EXPECT_EQ(base->limit, 2e-4);
}

TEST(StrangeData, TheWidthOfAHysteresisCountsTheApproach) {
  const Robot truth = with_effect(light_arm(), {"hysteresis_approach", "joint2", {2e-4, 3e-5}, {0.02}});
  const Discovery found = discover(light_arm(), measured_on(truth, 150, 0.01, 22), {}, quick());
  ASSERT_TRUE(names(found, "hysteresis_approach", "joint2")) << testing::PrintToString(labels(found));
  EXPECT_EQ(found.effects.size(), 1u) << testing::PrintToString(labels(found));
  const FoundParameter& width = found.effects[0].parameters[0];
  EXPECT_NEAR(width.value, 2e-4, 3.0 * width.standard_error);
  EXPECT_LT(width.standard_error, 5e-6);
}

// Half of what a wobble can do turns the next axis by a constant angle, which geometry does too.
TEST(StrangeData, WhatGeometryImitatesIsNotFittedBesideIt) {
  Robot robot = with_effect(light_arm(), {"axis_wobble", "joint3", {6e-5, 0.0, 0.0, 2e-5}});
  const Measurements measured = measured_on(robot, 200, 0.005, 23);
  robot.effects[0].values = {0.0, 0.0, 0.0, 0.0};
  const Calibration calibration = calibrate(robot, measured);
  for (const double value : calibration.robot.effects[0].values) EXPECT_LT(std::abs(value), 2e-4);
  EXPECT_LT(calibration.result.sigma, 1.2);
}

}  // namespace
}  // namespace llmt::robotics
