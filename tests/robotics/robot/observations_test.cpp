#include "robotics/observations.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace llmt::robotics {
namespace {

// An arm that bends, with two bases and three tools.
Robot cell() {
  Robot robot = ur_like();
  robot.chain.base = {.xyz_mm = {100.0, -200.0, 300.0}, .rpy_deg = {3.0, -5.0, 20.0}};
  robot.chain.bases = {{"b", {.xyz_mm = {900.0, 100.0, 50.0}, .rpy_deg = {-2.0, 4.0, 170.0}}}};
  robot.chain.tools = {{"t2", {.xyz_mm = {80.0, 10.0, 40.0}, .rpy_deg = {10.0, 0.0, 30.0}}},
                       {"t3", {.xyz_mm = {-60.0, 50.0, 70.0}, .rpy_deg = {0.0, 20.0, 0.0}}}};
  robot.chain.payload = {.mass_kg = 5.0, .com_mm = {10.0, 20.0, 80.0}};
  for (Joint& joint : robot.chain.joints) {
    joint.mass_kg = 3.0;
    joint.com_mm = {-100.0, 0.0, 20.0};
  }
  robot.effects = {{"joint_compliance", "joint2", {2e-5}, {}}, {"eccentricity", "joint3", {1e-3, -5e-4}, {}}};
  return robot;
}

std::vector<Observation> views() {
  Observation turned{.tool = "t3", .reading = Reading::orientation, .lever_mm = 700.0};
  turned.reference = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  return {{},
          {.base = "b"},
          {.tool = "t2"},
          {.base = "b", .tool = "t3"},
          turned,
          {.base = "b", .tool = "t2", .reading = Reading::distance}};
}

// The robot whose own base and tool are those of an observation.
Robot as_seen(Robot robot, const Observation& seen) {
  for (const NamedFrame& base : robot.chain.bases) {
    if (base.name == seen.base) robot.chain.base = base.frame;
  }
  for (const NamedFrame& tool : robot.chain.tools) {
    if (tool.name == seen.tool) robot.chain.tool = tool.frame;
  }
  robot.chain.bases.clear();
  robot.chain.tools.clear();
  return robot;
}

TEST(Observations, AreReadOffTheArmWithThatBaseAndTool) {
  Robot robot = cell();
  robot.chain.payload.mass_kg = 0.0;  // it hangs where the first tool is
  const Poses plain = random_poses(robot.chain, 5, 1);
  const Poses seen = looked_at(plain, views());
  const Eigen::MatrixXd values = positions(robot, seen);
  const std::size_t count = views().size();
  for (Eigen::Index row = 0; row < seen.count(); ++row) {
    const Observation& view = seen.observations[row];
    const Eigen::Index pose = row / static_cast<Eigen::Index>(count);
    const Pose tool = tool_poses(as_seen(robot, view), select(plain, {pose}))[0];
    Eigen::Vector3d expected = tool.position_mm;
    if (view.reading == Reading::distance) expected = {tool.position_mm.norm(), 0.0, 0.0};
    if (view.reading == Reading::orientation) {
      const Eigen::AngleAxisd turn(tool.rotation * view.reference.transpose());
      expected = view.lever_mm * turn.angle() * turn.axis();
    }
    EXPECT_LT((values.row(row).transpose() - expected).norm(), 1e-8) << row;
  }
}

// Effects are derived to first order about the bent arm: some thousandths of them are left.
TEST(Observations, DerivativesAreThoseOfDifferences) {
  for (const bool bends : {false, true}) {
    Robot robot = cell();
    if (!bends) robot.effects.clear();
    const Poses seen = looked_at(random_poses(robot.chain, 4, 2), views());
    const Eigen::MatrixXd jacobian = position_jacobian(robot, seen);
    const std::vector<discovery::Parameter> all = parameters(robot);
    ASSERT_EQ(jacobian.cols(), std::ssize(all));
    Eigen::VectorXd values(jacobian.cols());
    for (Eigen::Index k = 0; k < values.size(); ++k) values(k) = all[k].value;
    for (Eigen::Index k = 0; k < values.size(); ++k) {
      const double step = 1e-3 * all[k].scale;
      Eigen::VectorXd moved = values;
      moved(k) += step;
      const Eigen::MatrixXd above = positions(with_values(robot, moved), seen);
      moved(k) -= 2.0 * step;
      const Eigen::MatrixXd below = positions(with_values(robot, moved), seen);
      const Eigen::MatrixXd difference = ((above - below) / (2.0 * step)).transpose();
      const Eigen::VectorXd expected = difference.reshaped();
      const double tolerance = (bends ? 2e-2 : 1e-6) * std::max(expected.norm(), 1.0);
      EXPECT_LT((jacobian.col(k) - expected).norm(), tolerance) << all[k].name << bends;
    }
  }
}

// In another order, of the first base and tool and of others, of joints and of effects.
TEST(Observations, DerivativesBySomeParametersAreTheColumnsOfThoseByAll) {
  for (const bool bends : {false, true}) {
    Robot robot = cell();
    if (!bends) robot.effects.clear();
    const Poses plain = random_poses(robot.chain, 4, 2);
    Robot one = robot;
    one.chain.bases.clear();
    one.chain.tools.clear();
    const std::vector<std::pair<Robot, Poses>> arms = {{robot, looked_at(plain, views())}, {one, plain}};
    for (const auto& [arm, poses] : arms) {
      const Eigen::MatrixXd all = position_jacobian(arm, poses);
      std::vector<Eigen::Index> columns;
      for (Eigen::Index k = all.cols() - 1; k >= 0; k -= 3) columns.push_back(k);
      EXPECT_EQ(position_jacobian(arm, poses, columns), all(Eigen::all, columns)) << bends;
      EXPECT_EQ(position_jacobian(arm, poses, {}).cols(), 0);
    }
  }
}

TEST(Observations, JointMotionsAndSignaturesAreThoseOfDifferences) {
  Robot robot = cell();
  robot.effects.clear();
  const Poses seen = looked_at(random_poses(robot.chain, 4, 3), views());
  const Eigen::MatrixXd motions = joint_motions(robot, seen);
  constexpr double step = 1e-6;
  for (Eigen::Index joint = 0; joint < 6; ++joint) {
    Poses above = seen;
    above.joints.col(joint).array() += step;
    Poses below = seen;
    below.joints.col(joint).array() -= step;
    const Eigen::MatrixXd difference = ((positions(robot, above) - positions(robot, below)) / (2.0 * step)).transpose();
    EXPECT_LT((motions.col(joint) - difference.reshaped()).norm(), 1e-5 * difference.norm()) << joint;
  }
  const Effect candidate{"link_bending", "joint2", {0.0}, {}};
  const Eigen::MatrixXd signature = effect_signatures(robot, {candidate}, seen);
  Robot bent = robot;
  const double value = 1e-4 * effect_parameters(robot.chain, candidate)[0].scale;
  bent.effects = {candidate};
  bent.effects[0].values[0] = value;
  const Eigen::MatrixXd difference = ((positions(bent, seen) - positions(robot, seen)) / value).transpose();
  EXPECT_LT((signature.col(0) - difference.reshaped()).norm(), 1e-3 * difference.norm());
}

TEST(Observations, OfFramesThatTheRobotLacksAreRefused) {
  const Robot robot = ur_like();
  const Poses seen = looked_at(random_poses(robot.chain, 2, 4), {{.tool = "t9"}});
  EXPECT_THROW(positions(robot, seen), std::invalid_argument);
  EXPECT_EQ(with_frames(robot, seen).chain.tools[0].name, "t9");
  EXPECT_EQ(positions(with_frames(robot, seen), seen), positions(robot, random_poses(robot.chain, 2, 4)));
}

}  // namespace
}  // namespace llmt::robotics
