#include "llmt/robotics/simulation.hpp"

#include <gtest/gtest.h>

#include "oracles/thrown.hpp"
#include "robotics/effects.hpp"

namespace llmt::robotics {
namespace {

Effect own(const std::string& name, const std::string& acts_on, const std::string& text) {
  return {.type = "formula", .at = "", .values = {1.0}, .formula = {name, {{acts_on, text}}}};
}

TEST(Positions, ThatAreNotFiniteNamePoseAndEffect) {
  Robot robot = with_effect(with_effect(ur_like(), own("fine", "z", "q1")), own("pole", "x", "1 / (q1 - 1)"));
  Poses poses{.joints = Eigen::MatrixXd::Zero(3, 6), .covariates = {}};
  EXPECT_EQ(position_refusal(robot, poses), "");
  poses.joints(1, 0) = 1.0;
  const std::string reason = position_refusal(robot, poses);
  EXPECT_TRUE(reason.starts_with("the tool position of pose 2 is inf, ")) << reason;
  EXPECT_TRUE(reason.ends_with("; effect formula[pole] makes it so")) << reason;
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { simulate(robot, poses); }), reason);
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { simulate(robot, poses, {.noise_um = 1.0}); }), reason);

  robot.effects.pop_back();
  robot.chain.joints[1].a_mm = 1e308;
  robot.chain.joints[2].a_mm = 1e308;
  EXPECT_TRUE(position_refusal(robot, poses).ends_with("; the geometry makes it so"));
  robot.chain.joints[2].a_mm = -1e200;  // far away is as bad: its square is no number
  robot.chain.joints[1].a_mm = 0.0;
  EXPECT_TRUE(position_refusal(robot, poses).ends_with("; the geometry makes it so"));
}

TEST(Simulation, IsBoundedBeforeItsWork) {
  EXPECT_EQ(oracle::thrown([] { simulate(ur_like(), {.poses = 1000000000}); }),
            "llmt::robotics::simulate: poses is 1000000000, must be between 1 and 1000000");
  EXPECT_THROW(simulate(ur_like(), {.poses = 0}), std::invalid_argument);
  for (const double noise : {-1.0, 1e300, std::nan("")}) {
    EXPECT_THROW(simulate(ur_like(), {.poses = 1, .noise_um = noise}), std::invalid_argument) << noise;
  }
}

// Else the noise would be a function of the poses that the same seed had made.
TEST(Simulation, NoiseAtGivenPosesIsNotDrawnFromTheStreamOfThePoses) {
  Robot robot = ur_like();
  for (Joint& joint : robot.chain.joints) joint.limits = {-180.0, 180.0};
  const Poses poses = simulate(robot, {.poses = 200, .seed = 4}).poses;
  const Measurements noisy = simulate(robot, poses, {.noise_um = 1000.0, .seed = 4});
  const Eigen::VectorXd noise = (noisy.positions_mm - positions(robot, poses)).col(0);
  Random same(4);
  Eigen::VectorXd drawn(200);
  for (double& value : drawn) {
    value = same.normal();
    same.normal();
    same.normal();
  }
  EXPECT_LT(std::abs((noise.array() * drawn.array()).mean()), 0.3);
}

}  // namespace
}  // namespace llmt::robotics
