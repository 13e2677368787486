// Which effects discovery considers at all.
#include <gtest/gtest.h>

#include <set>

#include "hypotheses/catalogue_effects.hpp"
#include "robotics/effects.hpp"

namespace llmt::robotics {
namespace {

struct Considered {
  std::set<std::string> effects;  // labels of hypotheses
  std::set<std::string> types;    // of hypotheses and of what cannot be tested
};

Considered considered(const Robot& robot, const Poses& poses) {
  const Eigen::VectorXd residuals = Eigen::VectorXd::Zero(3 * poses.count());
  const Scene scene = make_scene(robot, poses, residuals, {true, true, true});
  std::vector<discovery::UntestableCause> untestable;
  Considered result;
  for (const Hypothesis& hypothesis : catalogue_hypotheses(scene, effect_types(), untestable)) {
    result.effects.insert(effect_label(*hypothesis.effect));
    result.types.insert(hypothesis.effect->type);
  }
  for (const discovery::UntestableCause& cause : untestable) {
    result.types.insert(cause.what.substr(0, cause.what.find('@')));
  }
  return result;
}

Poses timed_poses(const Chain& chain) {
  Poses poses = furnished_poses(chain, 60, 3);
  poses.covariates["order"] = Eigen::VectorXd::LinSpaced(60, 1.0, 60.0);
  return poses;
}

std::set<std::string> errors_of_measuring(const Considered& all) {
  std::set<std::string> types;
  for (const std::string& type : all.types) {
    if (effect_type(type).of_measuring) types.insert(type);
  }
  return types;
}

TEST(Hypotheses, WithoutAnInstrumentItsErrorsAreNone) {
  Robot robot = ur_like();
  robot.chain.base.xyz_mm = {4000.0, 0.0, 0.0};  // as an instrument would see it
  Poses poses = timed_poses(robot.chain);
  EXPECT_GE(errors_of_measuring(considered(robot, poses)).size(), 5U);
  robot.chain.bases = {{"socket a", {}}, {"plane b", {}}};
  poses.observations.assign(60, {.base = "socket a"});
  for (int i = 30; i < 60; ++i) poses.observations[i].base = "plane b";
  EXPECT_TRUE(errors_of_measuring(considered(robot, poses)).empty());
  poses.observations[7].base = "";  // one point that was measured
  EXPECT_GE(errors_of_measuring(considered(robot, poses)).size(), 5U);
}

TEST(Hypotheses, NoSpringBalancesAnUprightAxis) {
  const auto has_spring = [](const Considered& all, const std::string& joint) {
    return std::ranges::any_of(
        all.effects, [&](const std::string& label) { return label.starts_with("counterbalance_spring@" + joint); });
  };
  Robot robot = ur_like();
  robot.chain.base.rpy_deg = {20.0, 30.0, 40.0};  // of the instrument's frame; gravity stands in the base
  const Considered upright = considered(robot, timed_poses(robot.chain));
  EXPECT_FALSE(has_spring(upright, "joint1"));
  EXPECT_TRUE(has_spring(upright, "joint2"));
  EXPECT_TRUE(upright.effects.contains("eccentricity@joint1"));
  robot.chain.gravity_m_s2 = {0.0, 9.81 * std::sin(0.2), -9.81 * std::cos(0.2)};  // on a slope
  EXPECT_TRUE(has_spring(considered(robot, timed_poses(robot.chain)), "joint1"));
}

}  // namespace
}  // namespace llmt::robotics
