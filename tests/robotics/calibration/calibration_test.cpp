#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/calibration_problem.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

double mean_error(const Robot& robot, const Measurements& measurements) {
  return distances(positions(robot, measurements.poses), measurements).mean();
}

bool is_fixed(const Calibration& calibration, const std::string& name) {
  return std::ranges::any_of(calibration.fixed, [&](const FixedParameter& p) { return p.name == name; });
}

// Measures a perturbed arm, calibrates the nominal one, and scores it on fresh poses.
struct Recovery {
  Calibration calibration;
  double fresh_error_mm;
};

Recovery recover(const Robot& nominal, double noise_mm, std::uint64_t seed, Eigen::Index poses = 150) {
  const Robot truth = perturbed(nominal, 1.0, 0.3, seed);
  const Measurements seen = measure(truth, random_poses(truth.chain, poses, seed + 1), noise_mm, seed + 2);
  const Measurements fresh = measure(truth, random_poses(truth.chain, 500, seed + 3), 0.0, 1);
  Recovery recovery{calibrate(nominal, seen), 0.0};
  recovery.fresh_error_mm = mean_error(recovery.calibration.robot, fresh);
  return recovery;
}

// Without noise the only error left is the pull of the priors, which is why the bounds are not rounding.
TEST(Calibration, RecoversPerturbedArmsOfEveryKind) {
  const std::vector<Robot> nominal = {ur_like(), mdh_like(), seven_axes(), scara()};
  const std::vector<Eigen::Index> identifiable = {27, 27, 31, 19};
  for (std::size_t i = 0; i < nominal.size(); ++i) {
    for (std::uint64_t seed = 100; seed < 105; ++seed) {
      const Recovery recovery = recover(nominal[i], 0.0, seed);
      EXPECT_TRUE(recovery.calibration.result.converged()) << i << ": " << recovery.calibration.result.reason;
      EXPECT_LT(recovery.fresh_error_mm, 1e-5) << i << " " << seed;
      if (i < 3) {
        EXPECT_EQ(recovery.calibration.result.rank, identifiable[i]) << i;
      }
    }
  }
}

// A map of one knot moves its joint by one number everywhere. Under the address sanitizer this fails if there is a look
// at the knot before or behind it.
TEST(Calibration, JointMapMayHaveOneKnot) {
  Robot robot = ur_like();
  robot.effects = {{"joint_map", "joint2", {1e-3}, {0.5, 0.1}}};
  const Measurements seen = measure(robot, random_poses(robot.chain, 60, 3), 0.0, 4);
  const Calibration calibration = calibrate(robot, seen);
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  EXPECT_LT(mean_error(calibration.robot, seen), 1e-6);
}

// n fresh-pose errors from p parameters on m poses are about noise * sqrt(p / m).
TEST(Calibration, ErrorOnFreshPosesIsOfTheSizeThatNoiseAllows) {
  for (const Robot& nominal : {ur_like(), mdh_like(), seven_axes()}) {
    const Recovery recovery = recover(nominal, 0.05, 200);
    const double expected = 0.05 * std::sqrt(static_cast<double>(recovery.calibration.result.rank) / 150.0);
    EXPECT_LT(recovery.fresh_error_mm, 2.0 * expected);
    EXPECT_NEAR(recovery.calibration.noise_mm, 0.05, 0.01);
  }
}

TEST(Calibration, ParallelAxesGetBetaInsteadOfDInBothConventions) {
  const Calibration ur = recover(ur_like(), 0.01, 300).calibration;
  EXPECT_FALSE(is_fixed(ur, "joint2.beta"));
  EXPECT_FALSE(is_fixed(ur, "joint3.beta"));
  EXPECT_TRUE(is_fixed(ur, "joint2.d"));
  EXPECT_TRUE(is_fixed(ur, "joint1.beta"));
  const Calibration mdh = recover(mdh_like(), 0.01, 301).calibration;
  EXPECT_FALSE(is_fixed(mdh, "joint3.beta"));
  EXPECT_TRUE(is_fixed(mdh, "joint3.d"));
}

TEST(Calibration, RedundantParametersStayNominalAndAreNamed) {
  const Calibration calibration = recover(ur_like(), 0.01, 302).calibration;
  for (const char* name :
       {"joint1.theta", "joint1.d", "joint6.theta", "joint6.d", "joint6.a", "joint6.alpha", "tool.rx"}) {
    EXPECT_TRUE(is_fixed(calibration, name)) << name;
  }
  EXPECT_EQ(calibration.robot.chain.joints[0].d_mm, ur_like().chain.joints[0].d_mm);
}

TEST(Calibration, WithoutTheGeneralRuleTheSolverNamesTheSameRedundancies) {
  const Robot nominal = ur_like();
  discovery::LeastSquaresProblem problem =
      calibration_problem(nominal, measure(nominal, random_poses(nominal.chain, 60, 1), 0.0, 2));
  const discovery::SolverResult result = discovery::solve(problem);
  EXPECT_EQ(result.rank, 27);
  bool base_and_joint1 = false;
  for (const discovery::Combination& combination : result.unidentifiable) {
    base_and_joint1 = base_and_joint1 || (combination.names() == "base.z, joint1.d");
  }
  EXPECT_TRUE(base_and_joint1);
}

TEST(Calibration, ToolOnTheLastAxisDoesNotSendParametersAway) {
  Robot nominal = ur_like();
  nominal.chain.tool.xyz_mm = {0.0, 0.0, 60.0};
  Robot truth = perturbed(nominal, 0.5, 0.1, 400);
  truth.chain.tool.xyz_mm = {0.1, -0.1, 61.0};
  const Measurements seen = measure(truth, random_poses(truth.chain, 300, 401), 0.05, 402);
  const Calibration calibration = calibrate(nominal, seen);
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  for (std::size_t j = 0; j < 6; ++j) {
    EXPECT_LT(std::abs(calibration.robot.chain.joints[j].a_mm - nominal.chain.joints[j].a_mm), 5.0);
    EXPECT_LT(std::abs(calibration.robot.chain.joints[j].d_mm - nominal.chain.joints[j].d_mm), 5.0);
  }
  EXPECT_LT(mean_error(calibration.robot, measure(truth, random_poses(truth.chain, 300, 403), 0.0, 1)), 0.04);
}

TEST(Calibration, UserFixesByNameAndByOwner) {
  const Robot nominal = mdh_like();
  const Robot truth = perturbed(nominal, 1.0, 0.1, 500);
  const Measurements seen = measure(truth, random_poses(truth.chain, 80, 501), 0.01, 502);
  const Calibration calibration = calibrate(nominal, seen, {.fixed = {"joint2.a", "joint4"}});
  EXPECT_EQ(calibration.robot.chain.joints[1].a_mm, nominal.chain.joints[1].a_mm);
  EXPECT_EQ(calibration.robot.chain.joints[3].theta_deg, nominal.chain.joints[3].theta_deg);
  const Calibration frames = calibrate(nominal, seen, {.only = {"base", "tool"}});
  EXPECT_EQ(geometric_values(frames.robot.chain).tail(36), geometric_values(nominal.chain).tail(36));
  EXPECT_THROW(calibrate(nominal, seen, {.fixed = {"joint9.a"}}), std::invalid_argument);
}

TEST(Calibration, FramesAreFoundFromAnyStart) {
  const Robot nominal = ur_like();
  for (std::uint64_t seed = 600; seed < 610; ++seed) {
    Robot truth = perturbed(nominal, 0.0, 0.0, seed);
    truth.chain.tool.xyz_mm = {120.0, -60.0, 200.0};
    const Measurements seen = measure(truth, random_poses(truth.chain, 50, seed + 1), 0.0, 1);
    Robot registered = nominal;
    const discovery::SolverResult result = register_frames(registered, seen);
    EXPECT_TRUE(result.converged()) << result.reason;
    EXPECT_LT(mean_error(registered, seen), 1e-7) << seed;
  }
}

TEST(Calibration, JointComplianceIsRecoveredTogetherWithGeometry) {
  Robot truth = perturbed(mdh_like(), 1.0, 0.1, 700);
  for (std::size_t j = 0; j < 6; ++j) {
    truth.chain.joints[j].mass_kg = 150.0 / static_cast<double>(j + 1);
    truth.chain.joints[j].com_mm = {100.0, 0.0, 20.0};
  }
  Robot nominal = mdh_like();
  for (std::size_t j = 0; j < 6; ++j) {
    nominal.chain.joints[j].mass_kg = truth.chain.joints[j].mass_kg;
    nominal.chain.joints[j].com_mm = truth.chain.joints[j].com_mm;
  }
  truth.effects = {{"joint_compliance", "joint2", {4e-7}}, {"joint_compliance", "joint3", {6e-7}}};
  nominal.effects = {{"joint_compliance", "joint2", {0.0}}, {"joint_compliance", "joint3", {0.0}}};
  Poses poses = random_poses(truth.chain, 200, 701);
  poses.covariates["payload_kg"] = Eigen::VectorXd::Zero(200);
  poses.covariates["payload_kg"].tail(100).setConstant(80.0);
  const Calibration calibration = calibrate(nominal, measure(truth, poses, 0.01, 702));
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  for (std::size_t e = 0; e < 2; ++e) {
    const std::string name = e == 0 ? "joint_compliance@joint2.compliance" : "joint_compliance@joint3.compliance";
    const double error = calibration.result.standard_error(name);
    EXPECT_NEAR(calibration.robot.effects[e].values[0], truth.effects[e].values[0], 4.0 * error);
    EXPECT_LT(error, 2e-8);
  }
}

TEST(Calibration, APayloadBelowZeroIsRefused) {
  const Robot robot = ur_like();
  Measurements seen = measure(robot, random_poses(robot.chain, 60, 1), 0.01, 2);
  seen.poses.covariates["payload_kg"] = Eigen::VectorXd::Constant(60, 5.0);
  EXPECT_NO_THROW(validate(seen, robot));
  seen.poses.covariates["payload_kg"](7) = -5.0;
  EXPECT_THROW(validate(seen, robot), std::invalid_argument);
}

TEST(Calibration, AnEarlierCalibrationsErrorsAndCorrectionAreForgotten) {
  Robot before = ur_like();
  before.identified = {{"joint1.a", 0.5, "free"}};
  before.correction_file = "old.json";
  const Calibration calibration = calibrate(before, measure(ur_like(), random_poses(before.chain, 60, 1), 0.01, 2));
  EXPECT_TRUE(calibration.robot.correction_file.empty());
  EXPECT_EQ(calibration.robot.identified.size(), parameters(before).size());
}

TEST(Calibration, MeasurementsThatDoNotSuitTheRobotAreRefused) {
  const Robot six = ur_like();
  const Measurements seven = measure(seven_axes(), random_poses(seven_axes().chain, 10, 1), 0.0, 1);
  EXPECT_THROW(calibrate(six, seven), std::invalid_argument);
}

// The priors of 5 mm and 1 degree are wrong there: they must not keep the fit from the minimum.
TEST(Calibration, ReachesTheNoiseFromDescriptionsThatAreFarOff) {
  for (const Robot& nominal : {ur_like(), mdh_like(), seven_axes()}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const Robot truth = perturbed(nominal, 30.0, 8.0, seed);
      const Measurements seen = measure(truth, random_poses(truth.chain, 60, seed), 0.05, seed + 1);
      const Calibration calibration = calibrate(nominal, seen);
      EXPECT_TRUE(calibration.result.converged());
      EXPECT_TRUE(calibration.began_without_priors);
      // 180 coordinates, 30 parameters: six standard deviations of the mean square; the priors take a little.
      EXPECT_LT(calibration.noise_mm, 0.05 * (1.0 + 6.0 / std::sqrt(2.0 * 150.0)));
    }
  }
  const Robot near = perturbed(ur_like(), 0.5, 0.1, 4);
  const Measurements seen = measure(near, random_poses(near.chain, 60, 5), 0.05, 6);
  EXPECT_FALSE(calibrate(ur_like(), seen).began_without_priors);
}

}  // namespace
}  // namespace llmt::robotics
