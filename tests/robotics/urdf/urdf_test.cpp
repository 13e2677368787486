#include "llmt/robotics/urdf.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "llmt/robotics/robot.hpp"
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
    const std::string written = to_urdf(text, "r.urdf", {}, chain);
    EXPECT_NE(written.find("<!-- kept -->"), std::string::npos);
    const Chain read = parse_urdf(written, "w.urdf");
    const Eigen::VectorXd q = random_values(chain, random);
    const Pose expected = forward(chain, q);
    const Pose found = forward(read, q);
    EXPECT_LT((expected.position_mm - found.position_mm).norm(), 1e-7);
    EXPECT_LT((expected.rotation - found.rotation).norm(), 1e-10);
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

std::string robot(const std::string& inside) { return "<robot name=\"r\">\n" + inside + "</robot>\n"; }

std::string joint(const std::string& name, const std::string& type, const std::string& parent, const std::string& child,
                  const std::string& more = "") {
  return fmt::format(
      "<joint name=\"{}\" type=\"{}\"><parent link=\"{}\"/><child link=\"{}\"/><axis xyz=\"0 0 1\"/>"
      "<limit lower=\"-1\" upper=\"2\" effort=\"1\" velocity=\"1\"/>{}</joint>\n",
      name, type, parent, child, more);
}

std::string message(const std::string& text, const UrdfLinks& links = {}) {
  try {
    parse_urdf(text, "arm.urdf", links);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(Urdf, WhatIsNoArmIsRefusedByName) {
  const std::string links = "<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>\n";
  const std::string fork = robot(links + joint("j", "revolute", "a", "b") + joint("k", "revolute", "a", "c"));
  const auto says = [](const std::string& found, const std::string& expected) {
    EXPECT_NE(found.find(expected), std::string::npos) << found;
  };
  says(message("<robot name=\"r\">\n<link name=\"a\">\n</robot>\n"), "arm.urdf:");
  says(message("no XML"), "arm.urdf:");
  says(message("<sdf/>"), "no URDF");
  says(message(fork), "b (1 joints), c (1 joints)");
  EXPECT_EQ(message(fork, {.base = "", .tip = "c"}), "");
  says(message(fork, {.base = "", .tip = "x"}), "no link \"x\"; links: a, b, c");
  says(message(fork, {.base = "b", .tip = "c"}), "no joint between the links \"b\" and \"c\"");
  says(message(robot(links + joint("j", "floating", "a", "b") + joint("k", "revolute", "b", "c"))),
       "\"j\" is planar or");
  says(message(robot(links + joint("j", "revolute", "a", "b") +
                     joint("k", "revolute", "b", "c", "<mimic joint=\"finger\" multiplier=\"2\"/>"))),
       "\"k\" mimics \"finger\", which does not lie between base and tip");
  says(message(robot(links + joint("j", "fixed", "a", "b") + joint("k", "fixed", "b", "c"))), "no joint beyond");
  std::string deep;
  for (int k = 0; k < 200; ++k) deep += "<a>";
  says(message(deep), "nested deeper");
}

TEST(Urdf, LimitsAreKeptAndContinuousJointsHaveNone) {
  const Chain chain = parse_urdf(
      robot("<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/><link name=\"d\"/>\n" +
            joint("j", "revolute", "a", "b") + joint("k", "continuous", "b", "c") + joint("l", "prismatic", "c", "d")),
      "arm.urdf");
  ASSERT_TRUE(chain.joints[0].limits.has_value());
  EXPECT_NEAR((*chain.joints[0].limits)[1], 2.0 * 57.29577951308232, 1e-12);
  EXPECT_FALSE(chain.joints[1].limits.has_value());
  EXPECT_EQ((*chain.joints[2].limits)[0], -1000.0);
}

}  // namespace
}  // namespace llmt::robotics
