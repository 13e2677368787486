#include "llmt/robotics/discovery/discriminating_poses.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/effects.hpp"
#include "robotics/found.hpp"

namespace llmt::robotics {
namespace {

Robot rigid_planar() {
  Robot robot = read_robot(LLMT_ROBOTS_DIR "/planar_two_link.yaml");
  robot.effects.clear();
  return robot;
}

Robot bent_outer_link() { return with_effect(rigid_planar(), effect("link_bending", "joint2", {7.5e-6})); }

const std::vector<Effect> soft_elbow = {effect("joint_compliance", "joint2", {0.0})};

Poses measured_with_payload(double payload_kg) {
  Poses poses = simulate(rigid_planar(), {.poses = 40, .seed = 3}).poses;
  poses.covariates["payload_kg"] = Eigen::VectorXd::Constant(40, payload_kg);
  return poses;
}

Poses joined(const Poses& some, const Poses& more) {
  Poses all = some;
  all.joints.conservativeResize(some.count() + more.count(), Eigen::NoChange);
  all.joints.bottomRows(more.count()) = more.joints;
  Eigen::VectorXd& payload = all.covariates["payload_kg"];
  payload.conservativeResize(all.count());
  payload.tail(more.count()) = more.covariates.at("payload_kg");
  return all;
}

// Length of what the rival misses when it is fitted to all those poses: an independent oracle.
double missed_mm(const Robot& robot, const std::vector<Effect>& rival, const Poses& poses) {
  Robot without = robot;
  const Effect found = without.effects.back();
  without.effects.pop_back();
  const Eigen::VectorXd truth = effect_signatures(without, {found}, poses) *
                                Eigen::Map<const Eigen::VectorXd>(found.values.data(), std::ssize(found.values));
  const Eigen::MatrixXd geometry = position_jacobian(without, poses);
  const Eigen::MatrixXd own = effect_signatures(without, rival, poses);
  Eigen::MatrixXd columns(geometry.rows(), geometry.cols() + own.cols());
  columns << geometry, own;
  for (auto column : columns.colwise()) column.stableNormalize();
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
  decomposition.setThreshold(1e-8);
  decomposition.compute(columns);
  return (truth - columns * decomposition.solve(truth)).norm();
}

Poses poses_of(const Discrimination& telling) {
  Poses poses;
  poses.joints.resize(std::ssize(telling.poses), telling.poses.front().joints.size());
  Eigen::VectorXd payload(std::ssize(telling.poses));
  for (Eigen::Index i = 0; i < payload.size(); ++i) {
    const DiscriminatingPose& pose = telling.poses[i];
    poses.joints.row(i) = pose.joints.transpose();
    payload(i) = pose.payload_kg;
  }
  poses.covariates["payload_kg"] = payload;
  return poses;
}

// With one payload, bending of the last link and a soft joint before it are the same function of the pose.
TEST(DiscriminatingPoses, AnotherPayloadTellsBendingFromASoftJoint) {
  const Poses measured = measured_with_payload(10.0);
  const Discrimination telling = discriminating_poses(bent_outer_link(), 0, soft_elbow, measured, 0.005);
  EXPECT_FALSE(telling.none_can);
  EXPECT_TRUE(telling.payload_helps);
  EXPECT_DOUBLE_EQ(telling.noise_mm, 0.005);
  ASSERT_FALSE(telling.poses.empty());
  for (const DiscriminatingPose& pose : telling.poses) {
    EXPECT_DOUBLE_EQ(pose.payload_kg, 0.0);
    EXPECT_GT(pose.disagreement_mm, 0.005);
    EXPECT_LE(std::abs(pose.joints(0)), 90.0 * degree);
    EXPECT_LE(std::abs(pose.joints(1)), 135.0 * degree);
  }
  // By hand, outer link level: bending (F/3 + w/8)/EI, rival as stiff as it must be with 10 kg: 11.1/21.1 of that sag.
  const double weight = 9.81 * rigid_planar().chain.joints[1].mass_kg;
  const double loaded = 7.5e-3 * (98.1 / 3.0 + weight / 8.0);
  const double rival = loaded * (0.5 * weight) / (98.1 + 0.5 * weight);
  EXPECT_NEAR(telling.poses.front().disagreement_mm, rival - 7.5e-3 * weight / 8.0, 0.003);
}

TEST(DiscriminatingPoses, ProposedPosesTellMoreThanRandomOnes) {
  const Poses measured = measured_with_payload(10.0);
  const Discrimination telling = discriminating_poses(bent_outer_link(), 0, soft_elbow, measured, 1e-4);
  ASSERT_EQ(telling.poses.size(), 5U);
  const double proposed = missed_mm(bent_outer_link(), soft_elbow, joined(measured, poses_of(telling)));
  double sum = 0.0;
  for (const DiscriminatingPose& pose : telling.poses) sum += pose.disagreement_mm * pose.disagreement_mm;
  EXPECT_NEAR(proposed, std::sqrt(sum), 0.02 * proposed);
  for (std::uint64_t seed = 10; seed < 30; ++seed) {
    for (const double payload : {0.0, 10.0}) {
      Poses random = simulate(rigid_planar(), {.poses = 5, .seed = seed}).poses;
      random.covariates["payload_kg"] = Eigen::VectorXd::Constant(5, payload);
      EXPECT_GT(proposed, missed_mm(bent_outer_link(), soft_elbow, joined(measured, random))) << seed;
    }
  }
}

// More poses than are looked at in one go.
TEST(DiscriminatingPoses, AllOfManyMeasuredPosesCount) {
  Poses measured = simulate(rigid_planar(), {.poses = 1100, .seed = 3}).poses;
  measured.covariates["payload_kg"] = Eigen::VectorXd::Constant(1100, 10.0);
  const Discrimination telling = discriminating_poses(bent_outer_link(), 0, soft_elbow, measured, 1e-4, 2);
  ASSERT_EQ(telling.poses.size(), 2U);
  const double proposed = missed_mm(bent_outer_link(), soft_elbow, joined(measured, poses_of(telling)));
  const double expected = std::hypot(telling.poses[0].disagreement_mm, telling.poses[1].disagreement_mm);
  EXPECT_NEAR(proposed, expected, 0.02 * proposed);
}

TEST(DiscriminatingPoses, MeasuredPayloadsAreNotCalledNew) {
  Poses measured = measured_with_payload(10.0);
  measured.covariates["payload_kg"].head(20).setZero();
  const Discrimination telling = discriminating_poses(bent_outer_link(), 0, soft_elbow, measured, 1e-3);
  EXPECT_FALSE(telling.payload_helps);
}

TEST(DiscriminatingPoses, ExactAliasIsTold) {
  const Robot robot = with_effect(ur_like(), effect("eccentricity", "joint2", {2e-4, -1e-4}));
  const std::vector<Effect> spring = {effect("counterbalance_spring", "joint2", {0.0, 0.0}, {0.0, 0.0})};
  const Poses measured = random_poses(robot.chain, 60, 5);
  for (const double noise : {0.0, 0.001}) {
    const Discrimination telling = discriminating_poses(robot, 0, spring, measured, noise);
    EXPECT_TRUE(telling.none_can);
    EXPECT_FALSE(telling.payload_helps);
    EXPECT_TRUE(telling.poses.empty());
  }
  // Still one where the measured poses leave the rival undetermined, so that a plain fit would miss elsewhere.
  Poses still = measured;
  still.joints.col(1).setConstant(0.3);
  EXPECT_TRUE(discriminating_poses(robot, 0, spring, still, 0.001).none_can);
}

TEST(DiscriminatingPoses, RivalWithoutSignatureDisagreesAndNoEffectDoesNot) {
  const Poses measured = measured_with_payload(10.0);
  Robot weightless = bent_outer_link();
  weightless.chain.gravity_m_s2.setZero();
  EXPECT_TRUE(discriminating_poses(weightless, 0, soft_elbow, measured, 0.001).none_can);
  const Robot eccentric = with_effect(weightless, effect("eccentricity_twice", "joint2", {1e-3, 0.0}));
  const Discrimination telling = discriminating_poses(eccentric, 1, soft_elbow, measured, 0.001, 3);
  EXPECT_EQ(telling.poses.size(), 3U);
  EXPECT_FALSE(telling.payload_helps);
}

TEST(DiscriminatingPoses, PrismaticJointWithoutLimitsStaysWhereItWas) {
  Robot robot = weighted(scara());
  robot.effects = {effect("eccentricity_twice", "joint2", {1e-3, 0.0})};
  const Poses measured = random_poses(robot.chain, 40, 2);
  const Discrimination telling =
      discriminating_poses(robot, 0, {effect("joint_gain", "joint2", {0.0})}, measured, 0.001);
  ASSERT_FALSE(telling.poses.empty());
  for (const DiscriminatingPose& pose : telling.poses) {
    EXPECT_GE(pose.joints(2), measured.joints.col(2).minCoeff());
    EXPECT_LE(pose.joints(2), measured.joints.col(2).maxCoeff());
  }
}

TEST(DiscriminatingPoses, ConditionsAreThoseOfTheEffects) {
  const Robot robot = with_effect(weighted(ur_like()), effect("backlash_approach", "joint2", {2e-4}));
  const Poses measured = furnished_poses(robot.chain, 60, 4);
  const Discrimination telling =
      discriminating_poses(robot, 0, {effect("backlash_gravity", "joint2", {0.0})}, measured, 0.001, 2);
  ASSERT_FALSE(telling.poses.empty());
  ASSERT_EQ(telling.poses.front().conditions.size(), 1U);
  EXPECT_EQ(std::abs(telling.poses.front().conditions.at("dir2")), 1.0);
}

// The lost coordinate would have told.
TEST(DiscriminatingPoses, OnlyMeasuredAxesCount) {
  const Robot robot = with_effect(rigid_planar(), effect("eccentricity_twice", "joint2", {1e-3, 0.0}));
  const Poses measured = measured_with_payload(10.0);
  EXPECT_FALSE(discriminating_poses(robot, 0, soft_elbow, measured, 0.001, 1, 1, {true, true, false}).none_can);
  EXPECT_TRUE(discriminating_poses(robot, 0, soft_elbow, measured, 0.001, 1, 1, {false, false, true}).none_can);
}

TEST(DiscriminatingPoses, RefusesNonsense) {
  const Poses measured = measured_with_payload(10.0);
  const Robot robot = bent_outer_link();
  EXPECT_THROW(discriminating_poses(robot, 1, soft_elbow, measured, 0.01), std::invalid_argument);
  EXPECT_THROW(discriminating_poses(robot, 0, soft_elbow, select(measured, {}), 0.01), std::invalid_argument);
  EXPECT_THROW(discriminating_poses(robot, 0, soft_elbow, measured, -1.0), std::invalid_argument);
  EXPECT_THROW(discriminating_poses(robot, 0, soft_elbow, measured, std::numeric_limits<double>::quiet_NaN()),
               std::invalid_argument);
  EXPECT_THROW(discriminating_poses(robot, 0, soft_elbow, measured, 0.01, 0), std::invalid_argument);
}

}  // namespace
}  // namespace llmt::robotics
