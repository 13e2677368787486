#include "llmt/robotics/urdf.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/robot.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "robotics/urdf/random_urdf.hpp"

namespace llmt::robotics {
namespace {

using random_urdf::placed;
using random_urdf::Placed;
using random_urdf::random_joints;
using random_urdf::random_values;
using random_urdf::text_of;

TEST(Urdf, PosesAndJacobiansOfAThousandChainsAreThoseOfTheFormat) {
  Random random(1);
  double position = 0.0;
  double rotation = 0.0;
  double derivative = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const auto joints = random_joints(random);
    const Chain chain = parse_urdf(text_of(joints), "r.urdf");
    const Eigen::VectorXd q = random_values(chain, random);
    const Placed oracle = placed(joints, q);
    const Eigen::Isometry3d& tip = oracle.links.back();
    const Pose pose = forward(chain, q);
    position = std::max(position, (pose.position_mm - tip.translation()).norm());
    rotation = std::max(rotation, (pose.rotation - tip.linear()).norm());
    const auto jacobian = Kinematics(chain).joint_jacobian(q);
    for (std::size_t j = 0; j < oracle.axes.size(); ++j) {
      const Eigen::Vector3d turned = oracle.axes[j].cross(tip.translation() - oracle.points[j]);
      const Eigen::Vector3d linear = oracle.slides[j] ? oracle.axes[j] : turned;
      derivative = std::max(derivative, (jacobian.col(j).head(3) - linear).norm());
      const Eigen::Vector3d angular = oracle.slides[j] ? Eigen::Vector3d::Zero() : oracle.axes[j];
      derivative = std::max(derivative, (jacobian.col(j).tail(3) - angular).norm());
    }
  }
  EXPECT_LT(position, 1e-8);   // mm, of arms of some metres
  EXPECT_LT(rotation, 1e-11);  // rad
  EXPECT_LT(derivative, 1e-8);
  RecordProperty("position_mm", fmt::format("{}", position));
  RecordProperty("rotation_rad", fmt::format("{}", rotation));
}

TEST(Urdf, AxesThatAreNotParallelGiveTextbookParameters) {
  Random random(2);
  for (int k = 0; k < 200; ++k) {
    const Chain chain = parse_urdf(text_of(random_joints(random)), "r.urdf");
    for (std::size_t j = 0; j + 1 < chain.joints.size(); ++j) {
      EXPECT_LT(std::abs(chain.joints[j].beta_deg), 5.1);
      if (std::abs(std::sin(chain.joints[j].alpha_deg / 57.29578)) < 0.1) continue;
      EXPECT_NEAR(chain.joints[j].beta_deg, 0.0, 1e-8);
      EXPECT_NEAR(chain.joints[j].b_mm, 0.0, 1e-6);
    }
  }
}

TEST(Urdf, IdentifiedOriginsReadBackAsTheIdentifiedArm) {
  Random random(3);
  for (int k = 0; k < 100; ++k) {
    const std::string text = text_of(random_joints(random));
    Chain chain = parse_urdf(text, "r.urdf");
    for (Joint& joint : chain.joints) {
      joint.a_mm += random.normal();
      joint.d_mm += random.normal();
      joint.alpha_deg += 0.1 * random.normal();
      joint.theta_deg += 0.1 * random.normal();
      joint.beta_deg += 0.1 * random.normal();
    }
    const IdentifiedUrdf written = to_urdf(text, "r.urdf", {}, chain);
    EXPECT_FALSE(written.has_tool);  // the last joint moves
    EXPECT_NE(written.text.find("<!-- kept -->"), std::string::npos);
    const Chain read = parse_urdf(written.text, "w.urdf");
    const Eigen::VectorXd q = random_values(chain, random);
    const Pose expected = forward(chain, q);
    const Pose found = forward(read, q);
    EXPECT_LT((expected.position_mm - found.position_mm).norm(), 1e-7);
    EXPECT_LT((expected.rotation - found.rotation).norm(), 1e-10);
  }
}

// A quarter turn about y that is not quite one: roll and yaw are hardly known, but together.
TEST(Urdf, OriginsNearAQuarterTurnKeepTheirDigits) {
  const std::string text =
      "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>"
      "<joint name='j' type='continuous'><parent link='a'/><child link='b'/><origin xyz='0.1 0.2 0.3' rpy='0.4 0 0.7'/>"
      "<axis xyz='1 0 0'/></joint><joint name='k' type='fixed'><parent link='b'/><child link='c'/>"
      "<origin xyz='1 0 0' rpy='0.3 1.5707963267948966 0.2'/></joint></robot>";
  const Chain nominal = parse_urdf(text, "r.urdf");
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(1, 0.5);
  for (double off_deg = 1e-11; off_deg < 10.0; off_deg *= 10.0) {
    Chain chain = nominal;
    chain.tool.rpy_deg += Eigen::Vector3d(0.3, 1.0, -0.4) * off_deg;
    const Pose expected = forward(chain, q);
    const Pose found = forward(parse_urdf(to_urdf(text, "r.urdf", {}, chain).text, "w.urdf"), q);
    // Of the up to six angles of joint and tool, those below 1e-10 degrees are read as zero.
    EXPECT_LT((expected.rotation - found.rotation).norm(), 6.0 * std::sqrt(2.0) * 1e-10 / 57.29) << off_deg;
  }
}

// Two fixed joints hold the tip, and the last of them gets the tool, with its orientation.
TEST(Urdf, TheIdentifiedToolReadsBackWhereAFixedJointHoldsTheTip) {
  Random random(5);
  for (int k = 0; k < 100; ++k) {
    auto joints = random_joints(random);
    for (int fixed = 0; fixed < 2; ++fixed) {
      joints.push_back(joints.front());
      joints.back().type = "fixed";
      joints.back().xyz = {random.uniform(-0.3, 0.3), 0.1, random.uniform(-0.3, 0.3)};
    }
    const std::string text = text_of(joints);
    const Chain nominal = parse_urdf(text, "r.urdf");
    Chain chain = nominal;
    for (Joint& each : chain.joints) {
      each.d_mm += random.normal();
      each.alpha_deg += 0.1 * random.normal();
    }
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      chain.tool.xyz_mm(axis) += 10.0 * random.normal();
      chain.tool.rpy_deg(axis) += random.normal();
    }
    const IdentifiedUrdf written = to_urdf(text, "r.urdf", {}, chain);
    EXPECT_TRUE(written.has_tool);
    const Eigen::VectorXd q = random_values(chain, random);
    const Pose expected = forward(chain, q);
    const Pose found = forward(parse_urdf(written.text, "w.urdf"), q);
    EXPECT_LT((expected.position_mm - found.position_mm).norm(), 1e-7);
    EXPECT_LT((expected.rotation - found.rotation).norm(), 1e-10);
    // What does not belong to the tool stays: the link before the tip moves as the arm does, without the new tool.
    const UrdfLinks before{.base = "", .tip = fmt::format("l{}", joints.size() - 1)};
    Chain shorter = parse_urdf(text, "r.urdf", before);
    shorter.joints = chain.joints;
    const Pose link = forward(parse_urdf(written.text, "w.urdf", before), q);
    EXPECT_LT((forward(shorter, q).position_mm - link.position_mm).norm(), 1e-7);
    // Where further links hang on the tip, it is no tool.
    EXPECT_FALSE(to_urdf(text, "r.urdf", before, shorter).has_tool);
  }
}

TEST(Urdf, CentresOfMassAreThoseOfAllThatAJointCarries) {
  Random random(4);
  for (int k = 0; k < 100; ++k) {
    const auto joints = random_joints(random);
    const Chain chain = parse_urdf(text_of(joints), "r.urdf");
    const Eigen::VectorXd q = random_values(chain, random);
    const Placed oracle = placed(joints, q);
    const Skeleton skeleton = Kinematics(chain).skeleton(q);
    std::vector<double> mass(chain.joints.size(), 0.0);
    std::vector<Eigen::Vector3d> moment(chain.joints.size(), Eigen::Vector3d::Zero());
    int body = -1;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      if (joints[j].type != "fixed") ++body;
      if (body < 0) continue;
      mass[body] += joints[j].mass;
      moment[body] += joints[j].mass * (oracle.links[j] * Eigen::Vector3d(1000.0 * joints[j].centre));
    }
    for (std::size_t j = 0; j < chain.joints.size(); ++j) {
      EXPECT_NEAR(chain.joints[j].mass_kg, mass[j], 1e-12);
      EXPECT_LT((skeleton.body_centre[j] - moment[j] / mass[j]).norm(), 1e-8);
    }
  }
}

// Exporters write `.URDF`, and many keep `robot.xml`.
TEST(Urdf, IsKnownByItsEndingInAnyCaseOrByItsContent) {
  Random random(4);
  const auto joints = random_joints(random);
  const std::string folder = ::testing::TempDir();
  for (const char* name : {"arm.URDF", "arm.xml", "arm.urdf"}) {
    const std::string path = folder + name;
    write_file(path, text_of(joints));
    EXPECT_TRUE(is_urdf(path)) << name;
    EXPECT_EQ(read_robot(path).chain.joints.size(), parse_urdf(text_of(joints), "r.urdf").joints.size()) << name;
  }
  write_file(folder + "arm.yaml", to_yaml(Robot{.chain = parse_urdf(text_of(joints), "r.urdf")}));
  EXPECT_FALSE(is_urdf(folder + "arm.yaml"));
  EXPECT_FALSE(is_urdf(folder + "nothing there"));
}

}  // namespace
}  // namespace llmt::robotics
