#include <gtest/gtest.h>

#include <filesystem>

#include "llmt/robotics/robot_file.hpp"

namespace llmt::robotics {
namespace {

Chain shipped(const std::string& name) { return read_robot(LLMT_ROBOTS_DIR "/" + name).chain; }

TEST(ShippedArms, AllDescriptionsRead) {
  int count = 0;
  for (const auto& file : std::filesystem::directory_iterator(LLMT_ROBOTS_DIR)) {
    EXPECT_NO_THROW(read_robot(file.path().string())) << file.path();
    ++count;
  }
  EXPECT_GE(count, 10);
}

// Worked out by hand from lengths that the makers publish.
TEST(ShippedArms, FlangesStandWhereTheLengthsOfTheMakersPutThem) {
  const auto at = [](const std::string& name) {
    const Chain chain = shipped(name);
    return forward(chain, Eigen::VectorXd::Zero(std::ssize(chain.joints))).position_mm;
  };
  const auto near = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { EXPECT_LT((a - b).norm(), 1e-9) << a; };
  near(at("panda.yaml"), {88.0, 0.0, 333.0 + 316.0 + 384.0 - 107.0});
  near(at("iiwa7.yaml"), {0.0, 0.0, 340.0 + 400.0 + 400.0 + 126.0});
  near(at("ur3e.yaml"), {-243.55 - 213.2, -131.05 - 92.1, 151.85 - 85.35});
  near(at("ur5e.yaml"), {-425.0 - 392.2, -133.3 - 99.6, 162.5 - 99.7});
  near(at("ur10e.yaml"), {-612.7 - 571.55, -174.15 - 116.55, 180.7 - 119.85});
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
