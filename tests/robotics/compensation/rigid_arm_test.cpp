#include "llmt/robotics/rigid_arm.hpp"

#include <gtest/gtest.h>

#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/effects.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

Robot bending_arm() {
  Robot robot = read_robot(LLMT_ROBOTS_DIR "/tx200_like.yaml");
  robot.effects = {make_effect(effect_type("joint_compliance"), robot.chain, 1),
                   make_effect(effect_type("joint_compliance"), robot.chain, 2)};
  robot.effects[0].values = {6e-7};
  robot.effects[1].values = {9e-7};
  return robot;
}

double error_of(Robot alone, const Measurements& fresh) {
  register_frames(alone, fresh);
  return distances(positions(alone, fresh.poses), fresh).mean();
}

// Identified beside effects, the geometry is not that which comes nearest without them.
TEST(RigidArm, GeometryAloneIsNoWorseThanACalibrationWithoutEffects) {
  const Robot real = bending_arm();
  Robot plain = real;
  plain.effects.clear();
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Measurements seen = simulate(real, {.poses = 120, .noise_um = 20.0, .seed = seed});
    const Measurements fresh = simulate(real, {.poses = 300, .noise_um = 0.0, .seed = 100 + seed});
    const Robot whole = calibrate(real, seen).robot;
    Robot torn = whole;
    torn.effects.clear();
    const double without_effects = error_of(calibrate(plain, seen).robot, fresh);
    const double alone = error_of(geometry_alone({whole, {}}), fresh);
    EXPECT_LT(alone, 1.03 * without_effects) << seed;
    EXPECT_LT(alone, 0.95 * error_of(torn, fresh)) << seed;
  }
}

TEST(RigidArm, ARobotWithoutEffectsStaysAsItIs) {
  const Robot plain =
      calibrate(ur_like(), measure(perturbed(ur_like(), 0.3, 0.05, 1), random_poses(ur_like().chain, 60, 2), 0.02, 3))
          .robot;
  EXPECT_EQ(to_yaml(geometry_alone({plain, {}})), to_yaml(plain));
}

TEST(RigidArm, FramesOfTheNominalArmAreItsOwn) {
  const Robot real = perturbed(ur_like(), 0.3, 0.05, 7);
  const Measurements seen = measure(real, random_poses(real.chain, 80, 8), 0.02, 9);
  const Calibration found = calibrate(ur_like(), seen);
  Robot fitted = ur_like();
  fitted.chain = with_fitted_frames(fitted.chain, {found.robot, {}});
  Robot taken = ur_like();
  taken.chain.base = found.robot.chain.base;
  taken.chain.tool = found.robot.chain.tool;
  const auto error = [&](const Robot& robot) { return distances(positions(robot, seen.poses), seen).mean(); };
  EXPECT_LT(error(fitted), error(taken));
  EXPECT_LT(error(fitted), 1.15 * error(found.registered));
}

}  // namespace
}  // namespace llmt::robotics
