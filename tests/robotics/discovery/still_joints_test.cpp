// An arm of seven joints of which only two move: what the others could tell must not be made up.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "llmt/random.hpp"
#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "robotics/effects.hpp"
#include "robotics/found.hpp"

namespace llmt::robotics {
namespace {

Robot described_arm() { return read_robot(LLMT_ROBOTS_DIR "/iiwa7.yaml"); }

// The arm with masses that its description has not, a payload, errors of geometry, and one soft joint.
Robot true_arm(std::uint64_t seed) {
  Robot robot = described_arm();
  Random random(seed);
  constexpr std::array<double, 7> masses = {3.5, 3.5, 4.1, 3.5, 2.2, 2.4, 0.4};
  for (std::size_t j = 0; j < masses.size(); ++j) {
    Joint& joint = robot.chain.joints[j];
    joint.mass_kg = masses[j];
    joint.com_mm = {0.0, j == 0 ? -30.0 : 40.0, j % 2 == 0 ? -60.0 : 35.0};
    joint.a_mm += 0.3 * random.normal();
    joint.d_mm += 0.3 * random.normal();
    joint.alpha_deg += 0.05 * random.normal();
    joint.theta_deg += 0.1 * random.normal();
  }
  robot.chain.payload = {.mass_kg = 1.25, .com_mm = {0.0, 0.0, 40.0}};
  robot.effects = {{"joint_compliance", "joint2", {7.25e-5}}};
  return robot;
}

// Joints 1 and 2 have play of 0.3 mrad, whose side no column tells; the others tremble by 1e-5 to 1e-4 rad.
Measurements measured_arm(Eigen::Index n, std::uint64_t seed) {
  const Robot truth = true_arm(seed);
  Random random(seed + 500);
  const double widest1 = random.uniform(0.4, 1.4);
  const double widest2 = random.uniform(0.3, 1.1);
  const double tremble = std::pow(10.0, random.uniform(-5.0, -4.0));
  Poses poses;
  poses.joints = Eigen::MatrixXd::Zero(n, 7);
  for (Eigen::Index i = 0; i < n; ++i) {
    poses.joints(i, 0) = random.uniform(-widest1, widest1);
    poses.joints(i, 1) = 0.3 + random.uniform(-widest2, widest2);
    for (Eigen::Index j = 2; j < 7; ++j) poses.joints(i, j) = 0.5 * tremble * random.normal();
  }
  Poses true_poses = poses;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < 2; ++j) true_poses.joints(i, j) += random.uniform(0.0, 1.0) < 0.5 ? -3e-4 : 3e-4;
  }
  Measurements measured = measure(truth, true_poses, 0.05, seed + 1000);
  const Eigen::MatrixXd loads = gravity_loads(truth, true_poses);
  measured.poses = poses;
  for (Eigen::Index j = 0; j < 7; ++j) {
    Eigen::VectorXd torque = loads.col(j);
    for (double& value : torque) value += 0.3 * random.normal();
    measured.poses.covariates["tau" + std::to_string(j + 1) + "_Nm"] = torque;
  }
  return measured;
}

double missed_by(const Robot& robot, const Measurements& measured) {
  const Eigen::VectorXd errors = distances(positions(robot, measured.poses), measured);
  return errors.norm() / std::sqrt(static_cast<double>(errors.size()));
}

TEST(StillJoints, AreSaidAndNothingIsMadeUpOfTheirTrembling) {
  // Refits of these ran away, or what was written made the poses set aside worse; seeds 1 to 4 are as they come.
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 32U, 55U, 63U, 76U, 101U, 108U, 118U, 130U, 137U, 156U, 189U}) {
    const Measurements searched = measured_arm(49, seed);
    Measurements test = measured_arm(73, seed);
    test = select(test, {49, 50, 51, 52, 53, 54, 55, 56, 57, 58, 59, 60});
    const Discovery found = discover(described_arm(), searched, test, {.correct = false});
    const double missing = missed_by(found.before, searched);
    for (const FoundEffect& one : found.effects) {
      EXPECT_LE(one.rms_mm, missing) << seed << ": " << effect_label(one.effect);
      for (const double value : one.effect.values) EXPECT_LT(std::abs(value), 0.1) << effect_label(one.effect);
    }
    EXPECT_LT(found.noise_mm, missing) << seed;
    EXPECT_LE(found.held_out.after.mean, found.held_out.before.mean) << seed;
    EXPECT_LE(missed_by(found.improved.robot, searched), missing * (1.0 + 1e-9)) << seed;
    ASSERT_EQ(found.still.size(), 5U) << seed;
    for (std::size_t k = 0; k < 5; ++k) {
      EXPECT_EQ(found.still[k].joint, "joint" + std::to_string(k + 3));
      const Eigen::VectorXd q = searched.poses.joints.col(static_cast<Eigen::Index>(k) + 2);
      EXPECT_NEAR(found.still[k].range, (q.maxCoeff() - q.minCoeff()) / degree, 1e-9);
      EXPECT_EQ(found.still[k].unit, "deg");
    }
  }
}

TEST(StillJoints, KeepWhatOnlyTheirMotionTells) {
  const Measurements measured = measured_arm(80, 3);
  const Robot described = described_arm();
  const Calibration fitted = calibrate(described, measured);
  ASSERT_EQ(fitted.still.size(), 5U);
  const auto kept = std::ranges::count(fitted.fixed, unseen_motion, &FixedParameter::why);
  EXPECT_GT(kept, 0);
  const std::vector<discovery::Parameter> before = parameters(fitted.registered);
  const std::vector<discovery::Parameter> after = parameters(fitted.robot);
  for (const FixedParameter& one : fitted.fixed) {
    const auto k = std::ranges::find(after, one.name, &discovery::Parameter::name) - after.begin();
    EXPECT_EQ(after[k].value, before[k].value) << one.name;
  }
  // Held still exactly, the same parameters are free, and the fit is as good.
  Measurements held = measured;
  for (Eigen::Index j = 2; j < 7; ++j) held.poses.joints.col(j).setConstant(measured.poses.joints(0, j));
  const Calibration exact = calibrate(described, held);
  for (std::size_t k = 0; k < after.size(); ++k) {
    EXPECT_EQ(fitted.result.parameters[k].free, exact.result.parameters[k].free) << after[k].name;
  }
}

TEST(StillJoints, AreThoseWithinATenthOfADegree) {
  Measurements measured = measured_arm(40, 4);
  measured.poses.joints.col(4) = Eigen::VectorXd::LinSpaced(40, 0.0, 0.11 * degree);
  measured.poses.joints.col(5) = Eigen::VectorXd::LinSpaced(40, 0.0, 0.09 * degree);
  const Calibration fitted = calibrate(described_arm(), measured);
  std::vector<std::string> still;
  for (const StillJoint& one : fitted.still) still.push_back(one.joint);
  EXPECT_EQ(still, (std::vector<std::string>{"joint3", "joint4", "joint6", "joint7"}));
}

}  // namespace
}  // namespace llmt::robotics
