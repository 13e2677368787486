#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>

#include "llmt/robotics/robot_file.hpp"

namespace llmt::robotics {
namespace {

Chain shipped(const std::string& name) { return read_robot(LLMT_ROBOTS_DIR "/" + name).chain; }

struct ShippedArm {
  std::ptrdiff_t joints;
  Eigen::Vector3d flange_mm;  // with all joints at zero
  double tolerance_mm = 1e-9;
};

// Worked out by hand from lengths that the makers publish.
const std::map<std::string, ShippedArm> shipped_arms = {
    {"iiwa7.yaml", {7, {0.0, 0.0, 340.0 + 400.0 + 400.0 + 126.0}}},
    {"panda.yaml", {7, {88.0, 0.0, 333.0 + 316.0 + 384.0 - 107.0}}},
    {"planar_two_link.yaml", {2, {1000.0 + 1000.0, 2000.0, 0.0}}},
    // Its angles are as measured, up to 0.1 deg from the right ones; a reflector stands 40 mm beside the flange.
    {"tx200_like.yaml", {6, {250.0 + 40.0, 0.0, 642.0 + 950.0 + 800.0 + 194.0 + 90.0}, 5.0}},
    {"ur10.yaml", {6, {-612.0 - 572.3, -163.941 - 92.2, 127.3 - 115.7}}},
    {"ur10e.yaml", {6, {-612.7 - 571.55, -174.15 - 116.55, 180.7 - 119.85}}},
    {"ur3e.yaml", {6, {-243.55 - 213.2, -131.05 - 92.1, 151.85 - 85.35}}},
    {"ur5.yaml", {6, {-425.0 - 392.25, -109.15 - 82.3, 89.159 - 94.65}}},
    {"ur5e.yaml", {6, {-425.0 - 392.2, -133.3 - 99.6, 162.5 - 99.7}}},
    {"wam.yaml", {7, {45.0 - 45.0, 0.0, 550.0 + 300.0 + 60.0}}}};

TEST(ShippedArms, FlangesStandWhereTheLengthsOfTheMakersPutThem) {
  std::size_t count = 0;
  for (const auto& file : std::filesystem::directory_iterator(LLMT_ROBOTS_DIR)) {
    const std::string name = file.path().filename().string();
    ASSERT_TRUE(shipped_arms.contains(name)) << name;
    const ShippedArm& arm = shipped_arms.at(name);
    const Chain chain = shipped(name);
    ASSERT_EQ(std::ssize(chain.joints), arm.joints) << name;
    const Eigen::Vector3d found = forward(chain, Eigen::VectorXd::Zero(arm.joints)).position_mm;
    EXPECT_LT((found - arm.flange_mm).norm(), arm.tolerance_mm) << name << ": " << found.transpose();
    ++count;
  }
  EXPECT_EQ(count, shipped_arms.size());
}

TEST(ShippedArms, TheIiwasElbowAndShoulderBendOppositeWays) {
  const Chain chain = shipped("iiwa7.yaml");
  Eigen::VectorXd q = Eigen::VectorXd::Zero(7);
  q(1) = 1.5707963267948966;  // about +y: the arm falls to +x
  EXPECT_NEAR(forward(chain, q).position_mm.x(), 926.0, 1e-9);
  q(1) = 0.0;
  q(3) = 1.5707963267948966;  // about -y
  EXPECT_NEAR(forward(chain, q).position_mm.x(), -526.0, 1e-9);
}

}  // namespace
}  // namespace llmt::robotics
