// What a map of the gap says of residuals that are put there: a turn of one joint, a step, a drift.
#include "discovery/gap_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"

namespace llmt::robotics {
namespace {

Robot gap_arm() { return read_robot(LLMT_ROBOTS_DIR "/tx200_like.yaml"); }

Measurements without_gap(Eigen::Index poses) {
  return simulate(gap_arm(), {.poses = poses, .noise_um = 0.0, .seed = 9});
}

double share_of(const std::vector<GapMap::Share>& shares, const std::string& name) {
  const auto found = std::ranges::find(shares, name, &GapMap::Share::name);
  return found == shares.end() ? 0.0 : found->share;
}

// The third joint is a little off at every pose, each time by another angle.
TEST(GapMap, ATurnOfAJointActsLikeThatJoint) {
  const Robot robot = gap_arm();
  for (const bool sees_z : {true, false}) {
    Measurements seen = without_gap(20);
    seen.measured[2] = sees_z;
    const Eigen::MatrixXd motions = joint_motions(robot, seen.poses);
    for (Eigen::Index i = 0; i < 20; ++i) {
      const double angle = 1e-4 * std::sin(1.0 + static_cast<double>(i));
      seen.positions_mm.row(i) += angle * motions.col(2).segment(3 * i, 3).transpose();
    }
    const GapMap map = gap_map(robot, seen);
    ASSERT_EQ(map.acts_like.size(), 6U);
    EXPECT_EQ(map.acts_like[0].name, robot.chain.joints[2].name);
    EXPECT_NEAR(map.acts_like[0].share, 1.0, 1e-10);
    for (const GapMap::Share& other : map.acts_like) EXPECT_LE(other.share, 1.0 + 1e-12);
    EXPECT_TRUE(map.regions.empty());  // of twenty poses none are made
  }
}

// An error of 1 mm where q2 is above 10 degrees, and of 0.1 mm elsewhere.
TEST(GapMap, EveryPoseIsInOneRegion) {
  Measurements seen = without_gap(200);
  Eigen::Index large = 0;
  for (Eigen::Index i = 0; i < 200; ++i) {
    const bool is_beyond = seen.poses.joints(i, 1) > 10.0 * 0.017453292519943295;
    seen.positions_mm(i, 0) += is_beyond ? 1.0 : 0.1;
    large += is_beyond ? 1 : 0;
  }
  const GapMap map = gap_map(gap_arm(), seen);
  ASSERT_EQ(map.regions.size(), 2U);
  EXPECT_EQ(map.regions[0].poses, large);
  EXPECT_EQ(map.regions[1].poses, 200 - large);
  EXPECT_NEAR(map.regions[0].mean_mm, 1.0, 1e-9);
  EXPECT_NEAR(map.regions[1].mean_mm, 0.1, 1e-9);
  EXPECT_EQ(map.regions[0].conditions.find("q2 above "), 0U) << map.regions[0].conditions;
  EXPECT_EQ(map.regions[1].conditions.find("q2 up to "), 0U) << map.regions[1].conditions;
  ASSERT_FALSE(map.depends_on.empty());
  EXPECT_EQ(map.depends_on[0].name, "q2");
}

// A drift is seen by the time or by the order of the poses, whichever the table has.
TEST(GapMap, ADriftDependsOnTimeOrOrder) {
  for (const std::string name : {"time_s", "order", "temp_C", "payload_kg"}) {
    Measurements seen = without_gap(120);
    seen.poses.covariates[name] = Eigen::VectorXd::LinSpaced(120, 0.0, 119.0);
    seen.positions_mm.col(1) += Eigen::VectorXd::LinSpaced(120, 0.0, 1.0);
    const GapMap map = gap_map(gap_arm(), seen);
    EXPECT_GT(share_of(map.depends_on, name), 0.9) << name;
  }
}

}  // namespace
}  // namespace llmt::robotics
