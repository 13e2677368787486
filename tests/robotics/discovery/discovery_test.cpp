#include "llmt/robotics/discovery/discovery.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/effects.hpp"
#include "robotics/found.hpp"

namespace llmt::robotics {
namespace {

using discovery::Answer;

constexpr double um = 1e-3;

Robot arm(const std::string& name) { return read_robot(LLMT_ROBOTS_DIR "/" + name + ".yaml"); }

Robot rigid(Robot robot) {
  robot.effects.clear();
  return robot;
}

Measurements in_plane(Measurements measurements) {
  measurements.measured = {true, true, false};
  measurements.positions_mm.col(2).setZero();
  return measurements;
}

Measurements seen(const Robot& truth, Eigen::Index poses, double noise_mm, std::uint64_t seed) {
  return simulate(truth, {.poses = poses, .noise_um = noise_mm / um, .seed = seed});
}

// A real arm differs from its description: 0.3 mm and 0.3 mrad or so.
Robot built(Robot robot, std::uint64_t seed) {
  Random random(seed);
  for (Joint& joint : robot.chain.joints) {
    joint.a_mm += 0.3 * random.normal();
    joint.d_mm += 0.3 * random.normal();
    joint.theta_deg += 0.02 * random.normal();
  }
  return robot;
}

bool has(const std::vector<std::string>& all, const std::string& one) {
  return std::ranges::find(all, one) != all.end();
}

DiscoveryOptions plain() {
  DiscoveryOptions options;
  options.correct = false;
  return options;
}

TEST(Discovery, NamesTheBendingOfThePapersArm) {
  const Robot flexible = arm("planar_two_link");
  const Measurements measured = in_plane(seen(flexible, 30, 10 * um, 1));
  const Measurements fresh = in_plane(seen(flexible, 300, 0.0, 2));
  const Discovery found = discover(rigid(flexible), measured, fresh);
  // With one payload two soft joints move the tool nearly as the bent links do: the name has them as a rival.
  EXPECT_TRUE(found.answer == Answer::named || found.answer == Answer::indistinguishable) << to_string(found.answer);
  EXPECT_EQ(labels(found), (std::vector<std::string>{"link_bending@joint1", "link_bending@joint2"}));
  for (const FoundEffect& one : found.effects) EXPECT_TRUE(one.confirmed) << effect_label(one.effect);
  EXPECT_GT(found.held_out.before.mean, 0.05);
  EXPECT_LT(found.held_out.after.mean, 0.01);
}

TEST(Discovery, FindsNothingInNoise) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Robot planar = rigid(arm("planar_two_link"));
    const Discovery found = discover(planar, in_plane(seen(planar, 40, 20 * um, seed)));
    EXPECT_EQ(found.answer, Answer::nothing_missing) << "planar, seed " << seed;
    EXPECT_TRUE(found.effects.empty() && found.maps.empty() && !found.improved.correction);
  }
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Robot real = built(arm("tx200_like"), seed);
    const Discovery found = discover(arm("tx200_like"), seen(real, 60, 20 * um, seed));
    EXPECT_EQ(found.answer, Answer::nothing_missing) << "six axes, seed " << seed;
  }
}

TEST(Discovery, NamesASoftJointWithItsValueAndThenIsContent) {
  const double compliance = 2e-7;
  const Robot truth = with_effect(built(arm("tx200_like"), 3), effect("joint_compliance", "joint2", {compliance}));
  Poses poses = seen(truth, 100, 0.0, 4).poses;
  poses.covariates["payload_kg"] = Eigen::VectorXd::Zero(100);
  for (Eigen::Index i = 0; i < 100; i += 2) poses.covariates["payload_kg"](i) = 60.0;
  const Measurements measured = simulate(truth, poses, {.noise_um = 20.0, .seed = 5});
  const Discovery found = discover(arm("tx200_like"), measured, {}, plain());
  EXPECT_EQ(found.answer, Answer::named);
  ASSERT_EQ(labels(found), std::vector<std::string>{"joint_compliance@joint2"});
  const FoundEffect& soft = found.effects[0];
  EXPECT_TRUE(soft.confirmed);
  ASSERT_EQ(soft.parameters.size(), 1U);
  EXPECT_GT(soft.parameters[0].standard_error, 0.0);
  EXPECT_NEAR(soft.parameters[0].value, compliance, 3.0 * soft.parameters[0].standard_error);
  EXPECT_LT(soft.parameters[0].standard_error, 0.1 * compliance);
  EXPECT_LT(found.held_out.after.mean, 1.5 * found.held_out.floor_mm);
  EXPECT_GT(found.held_out.before.mean, 3.0 * found.held_out.after.mean);

  const Discovery again = discover(found.improved.robot, measured, {}, plain());
  EXPECT_EQ(again.answer, Answer::nothing_missing);
  EXPECT_TRUE(again.effects.empty());
}

TEST(Discovery, TellsAnExactAlias) {
  const Robot truth = with_effect(arm("tx200_like"), effect("eccentricity", "joint2", {4e-4, 3e-4}));
  const Discovery found = discover(arm("tx200_like"), seen(truth, 100, 10 * um, 6), {}, plain());
  EXPECT_EQ(found.answer, Answer::indistinguishable);
  ASSERT_EQ(found.effects.size(), 1U);
  EXPECT_TRUE(found.effects[0].exact_alias) << effect_label(found.effects[0].effect);
  std::vector<std::string> names = found.effects[0].rivals;
  names.push_back(effect_label(found.effects[0].effect));
  EXPECT_TRUE(has(names, "eccentricity@joint2"));
  EXPECT_TRUE(has(names, "counterbalance_spring@joint2[0,0]"));
}

// 0.3 mrad at 30 degrees of joint 3, 12 degrees wide.
Effect bump() {
  constexpr double first = -140.0 * degree;
  constexpr double step = 2.0 * degree;
  std::vector<double> values;
  for (int k = 0; k < 143; ++k) {
    const double off = (first + k * step - 30.0 * degree) / (12.0 * degree);
    values.push_back(3e-4 * std::exp(-0.5 * off * off));
  }
  return effect("joint_map", "joint3", values, {first, step});
}

TEST(Discovery, CallsABumpUnknownAndMapsIt) {
  const Robot truth = with_effect(arm("tx200_like"), bump());
  const Discovery found = discover(arm("tx200_like"), seen(truth, 200, 10 * um, 7), {}, plain());
  EXPECT_EQ(found.answer, Answer::unknown);
  ASSERT_FALSE(found.unknown.empty());
  EXPECT_EQ(found.unknown[0].pattern.acts_on, "joint3");
  for (const FoundEffect& one : found.effects) EXPECT_FALSE(one.confirmed) << effect_label(one.effect);
  ASSERT_FALSE(found.maps.empty());
  EXPECT_LT(found.held_out.after.mean, 0.8 * found.held_out.before.mean);
}

TEST(Discovery, TellsWhatItCannotTestWithoutColumns) {
  const Robot planar = rigid(arm("planar_two_link"));
  const Discovery found = discover(planar, in_plane(seen(planar, 40, 10 * um, 8)));
  const auto why = [&](const std::string& what) {
    const auto one = std::ranges::find(found.not_testable, what, &discovery::UntestableCause::what);
    return one == found.not_testable.end() ? std::string("(testable)") : one->why;
  };
  EXPECT_EQ(why("backlash_approach@joint1"), "there is no column dir1");
  EXPECT_EQ(why("thermal_growth"), "there is no column temp_C");
  EXPECT_EQ(why("joint_compliance@joint2"), "(testable)");
  for (const Visible& one : found.visible) EXPECT_GT(one.value, 0.0) << one.what;
}

TEST(Discovery, ListsALostPointAndNamesNothing) {
  const Robot robot = arm("tx200_like");
  Measurements measured = seen(robot, 60, 20 * um, 9);
  measured.positions_mm.row(17) += Eigen::RowVector3d(0.4, -0.3, 0.5);
  DiscoveryOptions options = plain();
  options.held_out_share = 0.0;
  const Discovery found = discover(robot, measured, {}, options);
  EXPECT_EQ(found.answer, Answer::nothing_missing);
  EXPECT_EQ(found.outliers, std::vector<Eigen::Index>{17});
  EXPECT_LT(found.noise_mm, 30 * um);
}

// Every pose three times.
Measurements repeated(const Robot& robot, Eigen::Index poses, double noise_mm) {
  const Measurements once = seen(robot, poses, 0.0, 10);
  Poses thrice;
  thrice.joints.resize(3 * poses, once.poses.joints.cols());
  thrice.covariates["pose"].resize(3 * poses);
  for (Eigen::Index i = 0; i < 3 * poses; ++i) {
    thrice.joints.row(i) = once.poses.joints.row(i / 3);
    thrice.covariates["pose"](i) = static_cast<double>(i / 3);
  }
  return simulate(robot, thrice, {.noise_um = noise_mm / um, .seed = 11});
}

TEST(Discovery, AveragesRepeatsThatNeverLeftThePose) {
  const Robot robot = arm("tx200_like");
  Measurements measured = repeated(robot, 60, 30 * um);
  const Discovery returned = discover(robot, measured);
  EXPECT_GT(returned.lack_of_fit.dof, 200);
  EXPECT_NEAR(returned.noise_mm, 30 * um, 3 * um);
  measured.poses.covariates["dwelled"] = Eigen::VectorXd::Ones(measured.count());
  const Discovery dwelled = discover(robot, measured);
  EXPECT_EQ(dwelled.lack_of_fit.dof, 0);
  EXPECT_NEAR(dwelled.noise_mm, 30 * um / std::sqrt(3.0), 4 * um);
}

// Standing still hides what returning to a pose adds: a lack of fit against such repeats is no missing effect.
TEST(Discovery, DoesNotTrustRepeatsThatStoodStill) {
  const Robot robot = arm("tx200_like");
  Measurements measured = repeated(robot, 60, 5 * um);
  Random random(12);
  for (Eigen::Index pose = 0; pose < 60; ++pose) {
    Eigen::RowVector3d shift;
    for (double& value : shift) value = 20 * um * random.normal();
    measured.positions_mm.middleRows(3 * pose, 3).rowwise() += shift;
  }
  EXPECT_EQ(discover(robot, measured).answer, Answer::nothing_missing);
}

TEST(Discovery, RefusesTooFewPoses) {
  const Robot robot = arm("tx200_like");
  EXPECT_THROW(discover(robot, seen(robot, 3, 0.0, 1)), std::invalid_argument);
}

}  // namespace
}  // namespace llmt::robotics
