// An effect is a row and an entry of the catalogue: table.cpp has both, and nothing else knows of the effect.
#include <gtest/gtest.h>

#include <algorithm>

#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/compensation.hpp"
#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "robotics/effects.hpp"
#include "robotics/exported_robot.hpp"
#include "robotics/found.hpp"

namespace llmt::robotics {
namespace {

constexpr double growth = 4e-5;  // 1/K

Poses warm_poses(const Chain& chain, Eigen::Index n, std::uint64_t seed) {
  Poses poses = random_poses(chain, n, seed);
  Random random(seed + 100);
  poses.covariates["temp_C"] = Eigen::VectorXd::NullaryExpr(n, [&] { return random.uniform(15.0, 30.0); });
  return poses;
}

Effect warm_gain(double value) { return {.type = "warm_gain", .at = "joint2", .values = {value}, .constants = {20.0}}; }

Robot warm_arm() { return with_effect(weighted(ur_like()), warm_gain(growth)); }

TEST(ToyEffect, IsListedBehindTheLibrarysWithTheSizesOfItsEntry) {
  EXPECT_EQ(effect_types().back().name, "warm_gain");
  EXPECT_EQ(effect_type("warm_gain").title, "encoder scale that grows with the temperature");
  EXPECT_EQ(effect_type("warm_gain").parameters[0].upper, 1e-3);
}

TEST(ToyEffect, IsCalibrated) {
  const Robot truth = warm_arm();
  Robot nominal = perturbed(weighted(ur_like()), 0.3, 0.02, 4);
  nominal.effects = {warm_gain(0.0)};
  const Calibration found = calibrate(nominal, measure(truth, warm_poses(truth.chain, 100, 1), 0.02, 2));
  const auto parameter =
      std::ranges::find(found.robot.identified, "warm_gain@joint2[20].growth", &IdentifiedParameter::name);
  ASSERT_NE(parameter, found.robot.identified.end());
  ASSERT_TRUE(parameter->standard_error.has_value());
  EXPECT_LT(*parameter->standard_error, 0.05 * growth);
  EXPECT_NEAR(found.robot.effects[0].values[0], growth, 4.0 * *parameter->standard_error);
}

// The row has discovery try the mean temperature as reference. The truth refers to another, and the difference is a
// gain of the joint: k (T - 20) q = k (T - mean) q + k (mean - 20) q.
TEST(ToyEffect, IsDiscovered) {
  const Robot truth = warm_arm();
  DiscoveryOptions options;
  options.correct = false;
  const Measurements measured = measure(truth, warm_poses(truth.chain, 120, 3), 0.02, 4);
  const Discovery found = discover(weighted(ur_like()), measured, {}, options);
  EXPECT_EQ(found.answer, discovery::Answer::named);
  ASSERT_EQ(found.effects.size(), 2U) << testing::PrintToString(labels(found));
  const auto named = [&](const std::string& type) -> const FoundEffect& {
    return *std::ranges::find(found.effects, type, [](const FoundEffect& one) { return one.effect.type; });
  };
  ASSERT_EQ(labels(found)[0], "joint_gain@joint2");
  ASSERT_TRUE(labels(found)[1].starts_with("warm_gain@joint2[")) << labels(found)[1];
  const FoundEffect& warm = named("warm_gain");
  EXPECT_TRUE(warm.confirmed);
  EXPECT_EQ(warm.title, "encoder scale that grows with the temperature");
  EXPECT_NEAR(warm.effect.values[0], growth, 4.0 * warm.parameters[0].standard_error);
  const FoundEffect& gain = named("joint_gain");
  EXPECT_NEAR(gain.effect.values[0], growth * (warm.effect.constants[0] - 20.0),
              4.0 * gain.parameters[0].standard_error);
}

TEST(ToyEffect, IsSavedAndReadAgain) {
  const std::string text = to_yaml(warm_arm());
  EXPECT_NE(text.find("growth_per_K"), std::string::npos);
  const Robot again = parse_robot(text, "again.yaml");
  ASSERT_EQ(again.effects.size(), 1U);
  EXPECT_EQ(effect_label(again.effects[0]), "warm_gain@joint2[20]");
  EXPECT_EQ(again.effects[0].values, std::vector<double>{growth});
  EXPECT_EQ(to_yaml(again), text);
}

class ToyEffectInC : public ExportedRobot {};

// The commands are held against the formula, not against the row: the error of joint 2 is added by hand.
TEST_F(ToyEffectInC, IsCompensatedAndExported) {
  const Robot truth = warm_arm();
  const Robot rigid = weighted(ur_like());
  const Poses poses = warm_poses(truth.chain, 100, 5);
  const Targets targets = targets_of(rigid, poses);
  const Compensation found = compensate({.robot = truth, .correction = {}}, targets);
  Poses commands = found.commands;
  const Eigen::ArrayXd warmth = poses.covariates.at("temp_C").array() - 20.0;
  commands.joints.col(1).array() *= 1.0 + growth * warmth;
  const Eigen::VectorXd off_mm = (positions(rigid, commands) - targets.positions_mm).rowwise().norm();
  Eigen::Index reached = 0;
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    if (found.outcomes[i] != Outcome::reached) continue;
    ++reached;
    EXPECT_LT(off_mm(i), 1e-5);
  }
  EXPECT_GT(reached, 90);
  EXPECT_GT(found.before_mm.maxCoeff(), 0.1);
  constexpr double bound_ulp = 32.0;
  EXPECT_LT(forward_apart({.robot = truth, .correction = {}}, poses), bound_ulp);
}

}  // namespace
}  // namespace llmt::robotics
