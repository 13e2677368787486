// Effects of heat, time and mishaps against robots that are described otherwise.
#include <gtest/gtest.h>

#include "robotics/effects.hpp"

namespace llmt::robotics {
namespace {

using Eigen::Vector3d;

// One pose of many at a temperature: the oracle is another robot for every pose.
Eigen::Vector3d rigid(const Robot& robot, const Poses& poses, Eigen::Index i) {
  return forward(robot.chain, poses.joints.row(i).transpose()).position_mm;
}

void grow(Joint& joint, double factor) {
  joint.a_mm *= factor;
  joint.b_mm *= factor;
  joint.d_mm *= factor;
}

TEST(WholeArmEffects, ThermalGrowthIsARobotWithAllLengthsScaled) {
  const Robot robot = weighted(ur_like());
  const Poses poses = furnished_poses(robot.chain, 8, 1);
  const Eigen::MatrixXd points = positions(with_effect(robot, {"thermal_growth", "", {2e-5}, {20.0}}), poses);
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    Robot warm = robot;
    const double factor = 1.0 + 2e-5 * (column_of(poses, "temp_C", i) - 20.0);
    for (Joint& joint : warm.chain.joints) grow(joint, factor);
    warm.chain.tool.xyz_mm *= factor;
    EXPECT_LT((points.row(i).transpose() - rigid(warm, poses, i)).norm(), 1e-9);
  }
}

TEST(WholeArmEffects, GrowthOfOneLinkIsARobotWithThatLinkScaled) {
  const Robot robot = weighted(ur_like());
  const Poses poses = furnished_poses(robot.chain, 8, 2);
  for (std::size_t j = 0; j < 6; ++j) {
    const Robot growing = with_effect(robot, {"link_thermal_growth", robot.chain.joints[j].name, {3e-5}, {18.0}});
    const Eigen::MatrixXd points = positions(growing, poses);
    for (Eigen::Index i = 0; i < poses.count(); ++i) {
      Robot warm = robot;
      const double factor = 1.0 + 3e-5 * (column_of(poses, "temp_C", i) - 18.0);
      grow(warm.chain.joints[j], factor);
      if (j == 5) warm.chain.tool.xyz_mm *= factor;
      EXPECT_LT((points.row(i).transpose() - rigid(warm, poses, i)).norm(), 1e-9) << j;
    }
  }
}

TEST(WholeArmEffects, PedestalCarriesTheWholeArmAlong) {
  const Robot robot = weighted(mdh_like());
  const Poses poses = furnished_poses(robot.chain, 5, 3);
  const Eigen::MatrixXd points =
      positions(with_effect(robot, {"base_thermal_drift", "", {0.01, -0.02, 0.03}, {20.0}}), poses);
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    Robot warm = robot;
    warm.chain.base.xyz_mm += (column_of(poses, "temp_C", i) - 20.0) * Vector3d(0.01, -0.02, 0.03);
    EXPECT_LT((points.row(i).transpose() - rigid(warm, poses, i)).norm(), 1e-9);
  }
}

TEST(WholeArmEffects, DriftRunsFromTheFirstTimeToTheLast) {
  const Robot robot = weighted(ur_like());
  Poses poses = random_poses(robot.chain, 3, 4);
  poses.covariates["order"] = Eigen::Vector3d(10.0, 30.0, 50.0);
  const Eigen::MatrixXd still = positions(robot, poses);
  Eigen::MatrixXd gone = positions(with_effect(robot, {"drift", "", {1.0, 2.0, -4.0}, {10.0, 50.0}}), poses) - still;
  EXPECT_LT(gone.row(0).norm(), 1e-12);
  EXPECT_LT((gone.row(1) - Eigen::RowVector3d(0.5, 1.0, -2.0)).norm(), 1e-12);
  EXPECT_LT((gone.row(2) - Eigen::RowVector3d(1.0, 2.0, -4.0)).norm(), 1e-12);
  // Time is preferred to order, and the parabola is t^2.
  poses.covariates["time_s"] = Eigen::Vector3d(100.0, 300.0, 0.0);
  gone = positions(with_effect(robot, {"drift_curved", "", {1.0, 0.0, 0.0, 0.0, 4.0, 0.0}, {100.0, 500.0}}), poses) -
         still;
  EXPECT_LT(gone.row(0).norm(), 1e-12);
  EXPECT_LT((gone.row(1) - Eigen::RowVector3d(0.5, 1.0, 0.0)).norm(), 1e-12);
  EXPECT_LT((gone.row(2) - Eigen::RowVector3d(-0.25, 0.25, 0.0)).norm(), 1e-12);
}

// A base that moved: another base frame. The first joint's origin of a standard DH chain is the base's.
TEST(WholeArmEffects, KnockIsARobotOnAnotherBaseFromThenOn) {
  const Robot robot = weighted(ur_like(), false);
  const Poses poses = furnished_poses(robot.chain, 10, 5);
  const double yaw = 2e-3;
  const Robot knocked = with_effect(robot, {"tracker_knock", "", {0.3, -0.2, 0.1, 0.0, 0.0, yaw}, {50.0}});
  const Eigen::MatrixXd points = positions(knocked, poses);
  Robot moved = robot;
  moved.chain.base.xyz_mm += Vector3d(0.3, -0.2, 0.1);
  moved.chain.base.rpy_deg(2) += yaw / degree;
  int later = 0;
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    const bool is_later = column_of(poses, "order", i) > 50.0;
    later += is_later;
    EXPECT_LT((points.row(i).transpose() - rigid(is_later ? moved : robot, poses, i)).norm(), 1e-9);
  }
  EXPECT_GT(later, 2);
  EXPECT_LT(later, 8);
}

TEST(WholeArmEffects, MissingColumnsAreNamed) {
  const Robot robot = ur_like();
  Poses poses = random_poses(robot.chain, 3, 6);
  const auto missing = [&](const std::string& type, std::size_t index) {
    std::string name = "none";
    EXPECT_FALSE(has_columns(effect_type(type), robot.chain, index, poses, &name));
    return name;
  };
  EXPECT_EQ(missing("thermal_growth", 0), "temp_C");
  EXPECT_EQ(missing("backlash_approach", 3), "dir4");
  EXPECT_EQ(missing("drift", 0), "time_s|order");
  EXPECT_EQ(missing("read_back_lag", 1), "qmeas2_rad|qmeas2_mm");
  EXPECT_TRUE(has_columns(effect_type("joint_gain"), robot.chain, 0, poses));
  try {
    positions(with_effect(robot, {"drift", "", {0, 0, 0}, {0, 1}}), poses);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("drift[0,1] needs the column time_s|order"), std::string::npos)
        << error.what();
  }
  poses.covariates["order"] = Eigen::Vector3d::Zero();
  EXPECT_TRUE(has_columns(effect_type("drift"), robot.chain, 0, poses));
}

}  // namespace
}  // namespace llmt::robotics
