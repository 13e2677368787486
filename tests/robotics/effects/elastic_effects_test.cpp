// Effects of weight against statics by other means: energies, beams in many pieces, robots described otherwise.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "llmt/robotics/robot_file.hpp"
#include "robotics/effects.hpp"

namespace llmt::robotics {
namespace {

using Eigen::Vector3d;

std::vector<Robot> arms() {
  return {weighted(ur_like()), weighted(mdh_like()), weighted(seven_axes()), weighted(scara())};
}

// Compares one effect with what `expected` says of every pose.
template <typename Expected>
void expect_positions(const Robot& robot, const Effect& effect, const Poses& poses, Expected expected,
                      double tolerance_mm) {
  const Eigen::MatrixXd points = positions(with_effect(robot, effect), poses);
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    const Eigen::VectorXd q = poses.joints.row(i).transpose();
    const double payload = column_of(poses, "payload_kg", i);
    EXPECT_LT((points.row(i).transpose() - expected(q, payload, i)).norm(), tolerance_mm)
        << effect.type << " pose " << i;
  }
}

TEST(ElasticEffects, LoadsOfJointsAreSlopesOfThePotentialEnergy) {
  for (const Robot& robot : arms()) {
    const Poses poses = furnished_poses(robot.chain, 5, 1);
    const Eigen::MatrixXd loads = gravity_loads(robot, poses);
    for (Eigen::Index i = 0; i < poses.count(); ++i) {
      for (Eigen::Index j = 0; j < loads.cols(); ++j) {
        const double expected =
            gravity_by_energy(robot, poses.joints.row(i).transpose(), column_of(poses, "payload_kg", i), j);
        EXPECT_NEAR(loads(i, j), expected, 1e-5) << robot.chain.name << j;
      }
    }
  }
}

TEST(ElasticEffects, ComplianceTurnsAJointInProportionToTheSlopeOfTheEnergy) {
  for (const Robot& robot : arms()) {
    const Poses poses = furnished_poses(robot.chain, 4, 2);
    for (std::size_t j = 0; j < robot.chain.joints.size(); ++j) {
      const bool turns = robot.chain.joints[j].type == JointType::revolute;
      const double compliance = 1e-6;  // rad/(N m) or m/N
      expect_positions(
          robot, {"joint_compliance", robot.chain.joints[j].name, {compliance}}, poses,
          [&](const Eigen::VectorXd& q, double payload, Eigen::Index) {
            // Equilibrium: the load is that of the arm as it has given way.
            double yielded = 0.0;
            Eigen::VectorXd bent = q;
            for (int pass = 0; pass < 20; ++pass) {
              yielded = compliance * gravity_by_energy(robot, bent, payload, j) * (turns ? 1.0 : 1000.0);
              bent(j) = q(j) + yielded;
            }
            return moved_tool(robot, q, j, yielded);
          },
          1e-6);
    }
  }
}

TEST(ElasticEffects, MeasuredTorqueTakesThePlaceOfTheModels) {
  const Robot robot = weighted(ur_like());
  const Poses poses = furnished_poses(robot.chain, 4, 3);
  expect_positions(
      robot, {"joint_compliance_measured", "joint3", {2e-6}}, poses,
      [&](const Eigen::VectorXd& q, double, Eigen::Index i) {
        return moved_tool(robot, q, 2, 2e-6 * column_of(poses, "tau3_Nm", i));
      },
      1e-9);
}

// The lumped moments by hand: in standard DH a link's vector in its own frame is (a, d sin alpha, d cos alpha).
TEST(ElasticEffects, FreeMassesWithTheMomentsOfTheTrueMassesAreJointCompliance) {
  const Robot robot = slanted(weighted(seven_axes()));
  const Poses poses = random_poses(robot.chain, 6, 4);
  const double compliance = 1e-6;
  const std::vector<Joint>& joints = robot.chain.joints;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    std::vector<double> moments;
    for (std::size_t k = j; k < joints.size(); ++k) {
      const double alpha = joints[k].alpha_deg * degree;
      const Vector3d link(joints[k].a_mm, joints[k].d_mm * std::sin(alpha), joints[k].d_mm * std::cos(alpha));
      double carried = robot.chain.payload.mass_kg;
      for (std::size_t beyond = k + 1; beyond < joints.size(); ++beyond) carried += joints[beyond].mass_kg;
      Vector3d sum = joints[k].mass_kg * (link + joints[k].com_mm) + carried * link;
      if (k + 1 == joints.size()) {
        sum += robot.chain.payload.mass_kg * (robot.chain.tool.xyz_mm + robot.chain.payload.com_mm);
      }
      for (const double value : sum) moments.push_back(compliance * robot.chain.gravity_m_s2.norm() * 1e-3 * value);
    }
    const std::string at = joints[j].name;
    const Eigen::MatrixXd free = positions(with_effect(robot, {"joint_compliance_free_masses", at, moments}), poses);
    const Eigen::MatrixXd known = positions(with_effect(robot, {"joint_compliance", at, {compliance}}), poses);
    EXPECT_LT((free - known).norm(), 1e-9) << at;
    EXPECT_GT((known - positions(robot, poses)).norm(), 1e-3) << at;
  }
}

// A link as a straight bar: along the common normal, in the plane of the link's centre of mass; or along the axis,
// where that is the longer way; the last link straight to the tool.
struct StraightBar {
  Vector3d begin;
  Vector3d end;
};

StraightBar straight_bar(const Robot& robot, const Skeleton& skeleton, std::size_t link) {
  const Vector3d& from = skeleton.joint_origin[link];
  const Vector3d& to = skeleton.link_end[link];
  if (link + 1 == robot.chain.joints.size()) return {from, to};
  const Vector3d z = skeleton.joint_axis[link];
  const double d = (to - from).dot(z);
  const Vector3d normal = (to - from) - d * z;
  if (normal.norm() < std::abs(d)) return {from, from + d * z};
  const Vector3d begin = from + (skeleton.body_centre[link] - from).dot(z) * z;
  return {begin, begin + normal};
}

// End displacement and slope of a link in 2000 pieces: each piece turns by (moment of all beyond it) ds / EI. The
// link's own weight is spread so that its centre is where it should be, as far as a density that changes in proportion
// allows.
TEST(ElasticEffects, BendingIsThatOfABeamInManyPieces) {
  const Robot robot = weighted(mdh_like());
  const Poses poses = furnished_poses(robot.chain, 3, 5);
  const double flexibility = 1e-9;  // so small that first order is exact enough
  for (std::size_t link = 0; link < 6; ++link) {
    expect_positions(
        robot, {"link_bending", robot.chain.joints[link].name, {flexibility}}, poses,
        [&](const Eigen::VectorXd& q, double payload, Eigen::Index) -> Vector3d {
          const Skeleton skeleton = Kinematics(robot.chain).skeleton(q);
          const auto [begin, end] = straight_bar(robot, skeleton, link);
          const Vector3d span = 1e-3 * (end - begin);
          if (span.norm() < 1e-9) return skeleton.tool.position_mm;
          const Vector3d chord = span.normalized();
          const Load tip = weight_beyond(robot, q, payload, link + 1, end);
          const Vector3d own = robot.chain.joints[link].mass_kg * (skeleton.base_rotation * robot.chain.gravity_m_s2);
          const double centre = 1e-3 * chord.dot(skeleton.body_centre[link] - begin) / span.norm();
          const double slant = std::clamp(6.0 * (centre - 0.5), -1.0, 1.0);
          constexpr int pieces = 2000;
          Vector3d turn = Vector3d::Zero();
          Vector3d shift = Vector3d::Zero();
          double weight_beyond_piece = 0.0;  // shares of the own weight, and their first moment from the begin
          double moment_beyond_piece = 0.0;
          for (int k = pieces - 1; k >= 0; --k) {
            const double at = (k + 0.5) / pieces;
            const double piece = (1.0 + slant * (2.0 * at - 1.0)) / pieces;
            weight_beyond_piece += 0.5 * piece;
            moment_beyond_piece += 0.5 * piece * at;
            const double left = 1.0 - at;  // share of the link beyond the middle of the piece
            const double arm = moment_beyond_piece - at * weight_beyond_piece;
            const Vector3d moment = tip.moment_Nm + (left * span).cross(tip.force_N) + (arm * span).cross(own);
            const Vector3d bent = flexibility * span.norm() / pieces * (moment - chord.dot(moment) * chord);
            turn += bent;
            shift += bent.cross(left * span);
            weight_beyond_piece += 0.5 * piece;
            moment_beyond_piece += 0.5 * piece * at;
          }
          const Vector3d& tool = skeleton.tool.position_mm;
          return tool + 1e3 * shift + turn.cross(tool - end);
        },
        2e-6);
  }
}

TEST(ElasticEffects, TorsionTurnsWhatIsBeyondAboutTheChord) {
  const Robot robot = weighted(ur_like());
  const Poses poses = furnished_poses(robot.chain, 4, 6);
  const double flexibility = 1e-6;
  for (const std::size_t link : {std::size_t{1}, std::size_t{2}, std::size_t{5}}) {
    expect_positions(
        robot, {"link_torsion", robot.chain.joints[link].name, {flexibility}}, poses,
        [&](const Eigen::VectorXd& q, double payload, Eigen::Index) -> Vector3d {
          const Skeleton skeleton = Kinematics(robot.chain).skeleton(q);
          const auto [begin, end] = straight_bar(robot, skeleton, link);
          const Vector3d span = end - begin;
          double torque = weight_beyond(robot, q, payload, link + 1, end).moment_Nm.dot(span.normalized());
          // The link's own weight twists the bar as far as its centre of mass.
          const Vector3d arm = skeleton.body_centre[link] - begin;
          const Vector3d own = robot.chain.joints[link].mass_kg * (skeleton.base_rotation * robot.chain.gravity_m_s2);
          const double reached = std::clamp(arm.dot(span) / span.squaredNorm(), 0.0, 1.0);
          torque += reached * 1e-3 * arm.cross(own).dot(span.normalized());
          const Eigen::AngleAxisd twist(flexibility * 1e-3 * span.norm() * torque, span.normalized());
          return end + twist * (skeleton.tool.position_mm - end);
        },
        1e-6);  // the way from the bar's end to the link's is turned to first order
  }
}

TEST(ElasticEffects, BaseTurnsByTheMomentOfTheWholeWeight) {
  for (const Robot& robot : arms()) {
    const Poses poses = furnished_poses(robot.chain, 4, 7);
    const double compliance = 1e-9;  // so small that the loads are those of the undeformed arm
    expect_positions(
        robot, {"elastic_base", "", {compliance}}, poses,
        [&](const Eigen::VectorXd& q, double payload, Eigen::Index) -> Vector3d {
          const Skeleton skeleton = Kinematics(robot.chain).skeleton(q);
          const Vector3d& origin = skeleton.joint_origin[0];
          const Vector3d turn = compliance * weight_beyond(robot, q, payload, 0, origin).moment_Nm;
          return origin + Eigen::AngleAxisd(turn.norm(), turn.normalized()) * (skeleton.tool.position_mm - origin);
        },
        1e-8);
    const Robot one = with_effect(robot, {"elastic_base", "", {compliance}});
    const Robot two = with_effect(robot, {"elastic_base_two", "", {compliance, compliance}});
    EXPECT_LT((positions(one, poses) - positions(two, poses)).norm(), 1e-9);
  }
}

TEST(ElasticEffects, OnThePlanarArmAnElasticBaseIsAnElasticFirstJoint) {
  Robot robot = read_robot(LLMT_ROBOTS_DIR "/planar_two_link.yaml");
  robot.effects.clear();
  const Poses poses = random_poses(robot.chain, 20, 8);
  const Eigen::MatrixXd base = positions(with_effect(robot, {"elastic_base", "", {1e-6}}), poses);
  EXPECT_LT((base - positions(with_effect(robot, {"joint_compliance", "joint1", {1e-6}}), poses)).norm(), 1e-9);
  // Gravity lies along base y there, so x and z are horizontal and the second one counts.
  EXPECT_LT((base - positions(with_effect(robot, {"elastic_base_two", "", {0.0, 1e-6}}), poses)).norm(), 1e-9);
}

// A robot whose elastic effects feel what a payload_error or a gravity_tilt changes.
Robot elastic(Robot robot) {
  robot.effects = {
      {"joint_compliance", "joint2", {1e-6}}, {"link_bending", "joint3", {1e-6}}, {"elastic_base", "", {1e-7}}};
  return robot;
}

TEST(ElasticEffects, PayloadErrorIsARobotWithAnotherPayload) {
  Robot robot = elastic(weighted(ur_like()));
  Robot other = robot;
  other.chain.payload.mass_kg += 1.5;
  other.chain.payload.com_mm += Vector3d(10.0, -20.0, 30.0);
  // Listed last and yet felt by those before it.
  const Robot corrected = with_effect(robot, {"payload_error", "", {1.5, 10.0, -20.0, 30.0}});
  const Poses poses = random_poses(robot.chain, 10, 9);
  EXPECT_LT((positions(corrected, poses) - positions(other, poses)).norm(), 1e-9);
  EXPECT_GT((positions(robot, poses) - positions(other, poses)).norm(), 1e-2);
  Poses empty = poses;
  empty.covariates["payload_kg"] = Eigen::VectorXd::Zero(10);
  EXPECT_EQ(positions(corrected, empty), positions(robot, empty));
}

TEST(ElasticEffects, GravityTiltIsARobotWithAnotherGravity) {
  const Robot robot = elastic(weighted(ur_like()));
  Robot other = robot;
  other.chain.gravity_m_s2 =
      Eigen::AngleAxisd(std::hypot(2e-3, 1e-3), Vector3d(2e-3, -1e-3, 0.0).normalized()) * robot.chain.gravity_m_s2;
  const Poses poses = random_poses(robot.chain, 10, 10);
  const Robot tilted = with_effect(robot, {"gravity_tilt", "", {2e-3, -1e-3}});
  EXPECT_LT((positions(tilted, poses) - positions(other, poses)).norm(), 1e-9);
  EXPECT_GT((positions(robot, poses) - positions(other, poses)).norm(), 1e-4);
}

}  // namespace
}  // namespace llmt::robotics
