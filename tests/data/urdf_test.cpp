// Arms as users have them.
#include "llmt/robotics/urdf.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "llmt/files.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

const std::string folder = std::string(LLMT_DATA_DIR) + "/urdf/";
const std::string shipped = std::string(LLMT_ROBOTS_DIR) + "/";

void skip_without(const std::string& path) {
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
}

TEST(UrdfFiles, ThePandaOfItsMakerIsTheShippedDescription) {
  skip_without(folder + "panda.urdf");
  const Chain file = read_urdf(folder + "panda.urdf", {.base = "", .tip = "panda_link8"});
  const Chain ours = read_robot(shipped + "panda.yaml").chain;
  ASSERT_EQ(file.joints.size(), 7);
  const Poses poses = random_poses(ours, 50, 1);
  for (Eigen::Index i = 0; i < 50; ++i) {
    const Eigen::VectorXd q = poses.joints.row(i).transpose();
    EXPECT_LT((forward(file, q).position_mm - forward(ours, q).position_mm).norm(), 1e-6);
    EXPECT_LT((forward(file, q).rotation - forward(ours, q).rotation).norm(), 1e-9);
  }
  for (std::size_t j = 0; j < 6; ++j) EXPECT_NEAR(file.joints[j].mass_kg, ours.joints[j].mass_kg, 1e-6);
}

TEST(UrdfFiles, TheUr10IsTheShippedDescriptionTurnedByHalfATurn) {
  skip_without(folder + "ur10_robot.urdf");
  const Chain file = read_urdf(folder + "ur10_robot.urdf", {.base = "base_link", .tip = "tool0"});
  const Chain ours = read_robot(shipped + "ur10.yaml").chain;
  const Poses poses = random_poses(ours, 50, 1);
  for (Eigen::Index i = 0; i < 50; ++i) {
    const Eigen::VectorXd q = poses.joints.row(i).transpose();
    const Eigen::Vector3d p = forward(ours, q).position_mm;
    EXPECT_LT((forward(file, q).position_mm - Eigen::Vector3d(-p.x(), -p.y(), p.z())).norm(), 0.01);
  }
}

TEST(UrdfFiles, EveryFileReadsAndReadsBack) {
  const std::vector<std::pair<std::string, std::string>> files = {{"ur5_robot", "tool0"},
                                                                  {"ur10_robot", "ee_link"},
                                                                  {"panda", "panda_hand"},
                                                                  {"kinova", "j2s6s200_end_effector"},
                                                                  {"z1", ""}};
  for (const auto& [name, tip] : files) {
    const std::string path = folder + name + ".urdf";
    skip_without(path);
    const UrdfLinks links{.base = "", .tip = tip};
    Chain chain = read_urdf(path, links);
    EXPECT_GE(chain.joints.size(), 6U) << name;
    chain.joints[1].a_mm += 1.0;
    chain.joints[2].alpha_deg += 0.1;
    const IdentifiedUrdf written = to_urdf(read_file(path), path, links, chain);
    const Chain read = parse_urdf(written.text, path, links);
    const Eigen::VectorXd q = random_poses(chain, 1, 3).joints.row(0).transpose();
    EXPECT_LT((forward(chain, q).position_mm - forward(read, q).position_mm).norm(), 1e-7) << name;
  }
}

}  // namespace
}  // namespace llmt::robotics
