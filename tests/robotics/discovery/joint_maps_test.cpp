#include "discovery/investigation/joint_maps.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "calibration/joint_map_shift.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/effects.hpp"

namespace llmt::robotics {
namespace {

// 0.3 mrad, 12 degrees wide, at several angles of the joint.
Effect bumps(const std::string& joint) {
  constexpr double first = -200.0 * degree;
  constexpr double step = 2.0 * degree;
  std::vector<double> values;
  for (int k = 0; k <= 200; ++k) values.push_back(3e-4 * std::pow(std::sin(2.0 * (first + k * step)), 7));
  return effect("joint_map", joint, values, {first, step});
}

double rms_error_mm(const Robot& robot, const Measurements& measurements) {
  return std::sqrt(distances(positions(robot, measurements.poses), measurements).squaredNorm() /
                   static_cast<double>(measurements.count()));
}

// Geometry and effects were projected out of the maps: a refit of both must find what the maps leave to them. An arm
// that bends has parameters that move the tool through the loads alone, which no calibration frees.
TEST(JointMaps, RefitOfAnArmThatBendsFindsWhatTheMapsLeaveToIt) {
  const Robot described = read_robot(LLMT_ROBOTS_DIR "/tx200_like.yaml");
  Robot truth = with_effect(described, effect("joint_compliance", "joint2", {2e-6}));
  truth = with_effect(truth, bumps("joint2"));
  truth = with_effect(truth, bumps("joint3"));
  const Measurements measured = simulate(truth, {.poses = 300, .noise_um = 10.0, .seed = 5});
  const Robot soft = with_effect(described, effect("joint_compliance", "joint2", {0.0}));
  const Calibration fitted = calibrate(soft, measured);
  const std::optional<JointMaps> maps = fit_joint_maps(fitted.robot, measured);
  ASSERT_TRUE(maps);

  Robot mapped = fitted.robot;
  mapped.effects.insert(mapped.effects.end(), maps->effects.begin(), maps->effects.end());
  const Unmapped moved = unmapped(mapped, measured);
  const Calibration again = calibrate(moved.robot, moved.measurements, {.start_as_given = true});
  EXPECT_GT(maps->gain_in_errors, 2.0);
  // Leaving a pose out makes its error larger, not smaller.
  EXPECT_LT(rms_error_mm(again.robot, moved.measurements), std::sqrt(maps->after.squaredNorm() / 300.0));
}

}  // namespace
}  // namespace llmt::robotics
