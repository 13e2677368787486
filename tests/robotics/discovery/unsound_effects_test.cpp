#include "discovery/investigation/unsound_effects.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <tuple>

#include "llmt/robotics/discovery/discovery.hpp"
#include "robotics/effects.hpp"

namespace llmt::robotics {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// An effect that was found, and a calibration with it.
struct Refit {
  Calibration baseline;
  Calibration fitted;
  std::vector<Hypothesis> found;
  Measurements kept;
};

Refit with_gain(double value, double standard_error) {
  Robot robot = with_effect(ur_like(), {"joint_gain", "joint2", {4e-4}});
  Refit one{
      .baseline = {}, .fitted = {}, .found = {}, .kept = measure(robot, random_poses(robot.chain, 60, 1), 0.02, 2)};
  one.baseline = calibrate(ur_like(), one.kept);
  one.fitted = calibrate(robot, one.kept);
  Hypothesis gain;
  gain.effect = robot.effects[0];
  gain.candidate.lower = Eigen::VectorXd::Constant(1, -1e-3);
  gain.candidate.upper = Eigen::VectorXd::Constant(1, 1e-3);
  one.found = {gain};
  one.fitted.robot.effects[0].values[0] = value;
  one.fitted.result.standard_errors.tail(1).setConstant(standard_error);
  return one;
}

bool is_refused(const Refit& one) { return !unsound(one.baseline, one.fitted, one.found, one.kept).empty(); }

TEST(UnsoundEffects, AreThoseBeyondTheirLimits) {
  Refit one = with_gain(4e-4, 1e-5);
  EXPECT_FALSE(is_refused(one));
  // So that the fit with the value is better than the baseline.
  one.baseline.robot.chain.tool.xyz_mm(0) += 100.0;
  for (const auto& [value, error, refused] : {std::tuple{1.1e-3, 1e-4, false},
                                              {1.1e-3, 1e-5, true},
                                              {-1.1e-3, 1e-5, true},
                                              {4e-4, nan, false},
                                              {1.1e-3, nan, true},
                                              {1.1e-3, std::numeric_limits<double>::infinity(), true}}) {
    one.fitted.robot.effects[0].values[0] = value;
    one.fitted.result.standard_errors.tail(1).setConstant(error);
    EXPECT_EQ(is_refused(one), refused) << value << " +- " << error;
  }
}

TEST(UnsoundEffects, AreAllThoseOfARefitThatIsWorseThanTheBaseline) {
  Refit one = with_gain(4e-4, 1e-5);
  one.fitted.robot.chain.tool.xyz_mm(0) += 100.0;
  EXPECT_TRUE(is_refused(one));
}

TEST(UnsoundEffects, WithoutLimitsAreThoseThatOthersMustCancel) {
  Refit one = with_gain(4e-4, 1e-5);
  one.found[0].candidate.lower.resize(0);
  one.found[0].candidate.upper.resize(0);
  EXPECT_FALSE(is_refused(one));
  const double missing = total_distance(one.baseline.robot, one.kept);
  EXPECT_NEAR(beyond_geometry(one.fitted.robot, one.fitted.robot.effects[0], one.kept).norm(), missing, 0.1 * missing);
  // Ten times as large, and what it does is no longer missing: something else cancels it.
  one.fitted.robot.effects[0].values[0] *= 10.0;
  const Eigen::MatrixXd cancelled = positions(one.fitted.robot, one.kept.poses);
  one.kept.positions_mm = cancelled;
  one.baseline.robot = one.fitted.robot;
  one.baseline.robot.chain.tool.xyz_mm(0) += 0.1;
  EXPECT_TRUE(is_refused(one));
}

// The error of a joint over its angle, which is a random walk: a map follows it, and no cause does.
Robot with_walks(std::uint64_t seed) {
  Robot robot = ur_like();
  Random random(seed);
  for (const char* joint : {"joint1", "joint2", "joint3", "joint4"}) {
    std::vector<double> table;
    double walk = 0.0;
    for (int k = 0; k <= 100; ++k) {
      walk += 8e-5 * random.normal();
      table.push_back(walk + 3e-4 * std::sin(0.1 * k));
    }
    robot = with_effect(robot, {"joint_map", joint, table, {-2.5, 0.05}});
  }
  return robot;
}

// A map of a joint and an eccentricity of the same joint can be large and cancel each other.
TEST(UnsoundEffects, NoNameStandsBesideAMapThatFollowsIt) {
  for (const std::uint64_t seed : {4U, 12U}) {
    const Robot truth = with_walks(seed);
    const Measurements measured = measure(truth, random_poses(truth.chain, 250, 40 + seed), 0.03, 50 + seed);
    const Discovery found = discover(ur_like(), measured, {}, {.held_out_share = 0.0, .correct = false});
    ASSERT_FALSE(found.maps.empty()) << seed;
    const double missing = distances(positions(found.before, measured.poses), measured).norm() / std::sqrt(250.0);
    for (const FoundEffect& one : found.effects) {
      EXPECT_NE(one.effect.type, "eccentricity_twice") << seed << " at " << one.effect.at;
      EXPECT_LE(one.family_rms_mm, missing) << seed << ": " << effect_label(one.effect);
    }
    EXPECT_LT(found.fitted_after.mean, 0.06) << seed;
  }
}

}  // namespace
}  // namespace llmt::robotics
