#include "llmt/robotics/kinematics.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

Isometry3d frame_matrix(const Frame& frame) {
  return Translation3d(frame.xyz_mm) * AngleAxisd(frame.rpy_deg(2) * degree, Vector3d::UnitZ()) *
         AngleAxisd(frame.rpy_deg(1) * degree, Vector3d::UnitY()) *
         AngleAxisd(frame.rpy_deg(0) * degree, Vector3d::UnitX());
}

// The textbook product of homogeneous matrices, written without the library.
Isometry3d textbook(const Chain& chain, const Eigen::VectorXd& q) {
  Isometry3d result = frame_matrix(chain.base);
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const Joint& j = chain.joints[i];
    const bool turns = j.type == JointType::revolute;
    const double moved = j.sign * q(i);
    const Isometry3d z = AngleAxisd(j.theta_deg * degree + (turns ? moved : 0.0), Vector3d::UnitZ()) *
                         Isometry3d(Translation3d(0.0, 0.0, j.d_mm + (turns ? 0.0 : moved)));
    const Isometry3d xy(Translation3d(j.a_mm, j.b_mm, 0.0));
    const Isometry3d rx(AngleAxisd(j.alpha_deg * degree, Vector3d::UnitX()));
    const Isometry3d ry(AngleAxisd(j.beta_deg * degree, Vector3d::UnitY()));
    result = chain.convention == Convention::dh ? result * z * xy * rx * ry : result * rx * xy * ry * z;
  }
  return result * frame_matrix(chain.tool);
}

std::vector<Robot> arms() {
  std::vector<Robot> arms = {ur_like(), mdh_like(), seven_axes(), scara()};
  for (std::size_t i = 0; i < arms.size(); ++i) {
    arms[i] = perturbed(arms[i], 3.0, 2.0, 10 + i);
    arms[i].chain.joints[1].b_mm = 7.0;
    arms[i].chain.tool.rpy_deg = {10.0, -20.0, 30.0};
  }
  return arms;
}

TEST(Chain, ForwardKinematicsEqualsTheProductOfMatrices) {
  for (const Robot& robot : arms()) {
    const Poses poses = random_poses(robot.chain, 20, 1);
    for (Eigen::Index i = 0; i < poses.count(); ++i) {
      const Eigen::VectorXd q = poses.joints.row(i).transpose();
      const Pose pose = forward(robot.chain, q);
      const Isometry3d expected = textbook(robot.chain, q);
      EXPECT_LT((pose.position_mm - expected.translation()).norm(), 1e-9);
      EXPECT_LT((pose.rotation - expected.linear()).norm(), 1e-12);
    }
  }
}

TEST(Chain, AnalyticJacobianEqualsCentralDifferences) {
  for (const Robot& robot : arms()) {
    discovery::LeastSquaresProblem problem;
    const Poses poses = random_poses(robot.chain, 5, 2);
    problem.parameters = parameters(robot);
    problem.residual = [&](const Eigen::VectorXd& values) -> Eigen::VectorXd {
      const Eigen::MatrixXd points = positions(with_values(robot, values), poses).transpose();
      return Eigen::Map<const Eigen::VectorXd>(points.data(), points.size());
    };
    problem.jacobian = [&](const Eigen::VectorXd& values) {
      return position_jacobian(with_values(robot, values), poses);
    };
    const discovery::JacobianCheck check = discovery::check_jacobian(problem);
    EXPECT_LT(check.error, 1e-6) << check.parameter;
  }
}

TEST(Chain, JointJacobianEqualsCentralDifferences) {
  constexpr double step = 1e-5;
  for (const Robot& robot : arms()) {
    const Kinematics kinematics(robot.chain);
    const Eigen::VectorXd q = random_poses(robot.chain, 1, 3).joints.row(0).transpose();
    const Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian = kinematics.joint_jacobian(q);
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      Eigen::VectorXd moved = q;
      moved(j) += step;
      const Pose above = kinematics.forward(moved);
      moved(j) -= 2.0 * step;
      const Pose below = kinematics.forward(moved);
      const AngleAxisd turn(above.rotation * below.rotation.transpose());
      EXPECT_LT((jacobian.col(j).head<3>() - (above.position_mm - below.position_mm) / (2.0 * step)).norm(), 1e-4);
      EXPECT_LT((jacobian.col(j).tail<3>() - turn.angle() * turn.axis() / (2.0 * step)).norm(), 1e-6);
    }
  }
}

TEST(Chain, PlanarArmWithBentLinksFollowsEquations12And13) {
  Robot robot = make_robot(Convention::mdh, {{0, 0, 0, 0}, {0, 1001, 0, 0}});
  robot.chain.base.xyz_mm = {0.0, 2000.0, 0.0};
  robot.chain.joints[1].b_mm = -0.41;
  robot.chain.tool.xyz_mm = {999.0, -0.36, 0.0};
  const double pi = std::numbers::pi;
  for (const double p12 : {-1.3, 0.0, 0.7}) {
    for (const double p23 : {-2.0, 0.1, 1.9}) {
      const Vector3d c = forward(robot.chain, Eigen::Vector2d(p12, p23)).position_mm;
      const double a = p12 + p23;
      EXPECT_NEAR(
          c(0),
          1001 * std::cos(p12) + 0.41 * std::cos(p12 + 1.5 * pi) + 999 * std::cos(a) + 0.36 * std::cos(a + 1.5 * pi),
          1e-9);
      EXPECT_NEAR(c(1),
                  2000 + 1001 * std::sin(p12) + 0.41 * std::sin(p12 + 1.5 * pi) + 999 * std::sin(a) +
                      0.36 * std::sin(a + 1.5 * pi),
                  1e-9);
    }
  }
}

TEST(Chain, DeformationOfALinkMovesEverythingBeyondIt) {
  const Robot robot = ur_like();
  const Kinematics kinematics(robot.chain);
  const Eigen::VectorXd q = random_poses(robot.chain, 1, 4).joints.row(0).transpose();
  const Skeleton rigid = kinematics.skeleton(q);
  Deformation deformation(6);
  deformation.link[1] = {.translation_mm = {0.1, 0.2, 0.3}, .rotation_rad = {1e-6, -2e-6, 3e-6}};
  deformation.joint(4) = 1e-6;
  deformation.world_mm = {0.0, 0.0, 1.0};
  const Skeleton bent = kinematics.skeleton(q, &deformation);
  EXPECT_EQ(bent.joint_origin[1], rigid.joint_origin[1]);
  EXPECT_LT((bent.joint_origin[2] - rigid.joint_origin[2] - deformation.link[1].translation_mm).norm(), 1e-12);
  const Vector3d expected = deformation.link[1].translation_mm +
                            deformation.link[1].rotation_rad.cross(rigid.tool.position_mm - rigid.link_end[1]) +
                            1e-6 * rigid.joint_axis[4].cross(rigid.tool.position_mm - rigid.joint_origin[4]);
  EXPECT_LT((bent.tool.position_mm - rigid.tool.position_mm - expected).norm(), 1e-5);
  const Vector3d seen = kinematics.forward(q, &deformation).position_mm;
  EXPECT_LT((seen - bent.tool.position_mm - deformation.world_mm).norm(), 1e-12);
}

// Gravity is given in the base frame as described: a pedestal that yields does not turn it. The deformation of a link
// is that of its far end, beyond its body.
TEST(Chain, DeformationMovesNeitherTheDirectionOfGravityNorTheBodyOfTheLink) {
  for (Robot robot : {ur_like(), mdh_like()}) {
    robot.chain.base.rpy_deg = {10.0, 20.0, 30.0};
    const Kinematics kinematics(robot.chain);
    const Eigen::VectorXd q = Eigen::VectorXd::Zero(6);
    Deformation deformation(6);
    deformation.base.rotation_rad = {1e-3, 0.0, 0.0};
    EXPECT_EQ(kinematics.skeleton(q, &deformation).base_rotation, kinematics.skeleton(q).base_rotation);
    Deformation bent(6);
    bent.link[2].translation_mm = {0.0, 0.0, 1.0};
    EXPECT_EQ(kinematics.skeleton(q, &bent).body_centre[2], kinematics.skeleton(q).body_centre[2]);
    EXPECT_NE(kinematics.skeleton(q, &bent).body_centre[3], kinematics.skeleton(q).body_centre[3]);
  }
}

// Roll and yaw come from entries of the size of the pitch's cosine: each alone is uncertain there.
TEST(RollPitchYaw, MakeTheSameRotationNextToAQuarterTurnOfPitch) {
  Random random(6);
  for (int digits = 0; digits <= 14; ++digits) {
    for (const double side : {-1.0, 1.0}) {
      Frame frame;
      frame.rpy_deg = {random.uniform(-179.0, 179.0), side * (90.0 - 50.0 * std::pow(10.0, -digits)),
                       random.uniform(-179.0, 179.0)};
      const Eigen::Matrix3d rotation = frame_matrix(frame).linear();
      const Vector3d angles = roll_pitch_yaw(rotation);
      const Frame again{.rpy_deg = angles / degree};
      const double most = digits < 12 ? 4e-15 : 2e-12;  // what is nearer counts as a quarter turn
      EXPECT_LT((frame_matrix(again).linear() - rotation).cwiseAbs().maxCoeff(), most) << frame.rpy_deg(1);
      if (digits < 3) {
        EXPECT_LT((again.rpy_deg - frame.rpy_deg).cwiseAbs().maxCoeff(), 1e-10);
      }
    }
  }
}

TEST(Chain, ValuesGoInAndComeOutUnchanged) {
  const Robot robot = perturbed(mdh_like(), 1.0, 1.0, 5);
  const Eigen::VectorXd values = geometric_values(robot.chain);
  EXPECT_EQ(geometric_values(with_geometric_values(mdh_like().chain, values)), values);
  EXPECT_EQ(values.size(), geometric_parameter_count(robot.chain));
  const std::vector<discovery::Parameter> named = geometric_parameters(robot.chain);
  EXPECT_EQ(named[joint_parameter(2, JointParameter::a)].name, "joint3.a");
  EXPECT_EQ(named[joint_parameter(2, JointParameter::a)].value, robot.chain.joints[2].a_mm);
  EXPECT_EQ(named[tool_parameter(FrameParameter::rz)].name, "tool.rz");
}

TEST(Chain, MistakesNameJointFieldAndValue) {
  const auto message_of = [](const Robot& robot) -> std::string {
    try {
      validate(robot);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  };
  Robot robot = ur_like();
  robot.chain.joints[2].sign = 0.5;
  EXPECT_NE(message_of(robot).find("joint3: sign is 0.5"), std::string::npos);
  robot = ur_like();
  robot.chain.joints[2].a_mm = std::nan("");
  EXPECT_NE(message_of(robot).find("joint3.a is nan"), std::string::npos);
  robot = ur_like();
  robot.chain.joints[2].name = "joint1";
  EXPECT_NE(message_of(robot).find("\"joint1\" is taken"), std::string::npos);
  robot = ur_like();
  robot.effects.push_back({.type = "joint_complience", .at = "joint2", .values = {0.0}});
  EXPECT_NE(message_of(robot).find("known: joint_compliance"), std::string::npos);
  EXPECT_THROW(forward(ur_like().chain, Eigen::VectorXd::Zero(5)), std::invalid_argument);
}

}  // namespace
}  // namespace llmt::robotics
