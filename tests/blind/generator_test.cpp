// The generator of the blind test, against closed forms and against itself.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "blind/case.hpp"
#include "blind/plan.hpp"

namespace blind {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double g = 9.81;

Arm planar() { return nominal_arm("planar"); }
double bar_mass() { return planar().joints[0].mass; }

Vector3d in_base(const Arm& arm, const VectorXd& q) {
  const Pieces pieces(arm);
  return pieces.base.inverse() * tool_point(pieces, q);
}

TEST(BlindGenerator, RigidMuJoCoArmStandsWhereOurKinematicsSays) {
  for (const char* name : {"planar", "tx200", "small6"}) {
    llmt::Random random(3);
    Arm described = nominal_arm(name);
    const Arm arm = build(described, random, false);
    Elasticity stiff;  // bars without hinges, so that the way through the segments is tested too
    stiff.bars = {{arm.planar ? 0 : 1, 0.0, 0.0, 7}, {arm.planar ? 1 : 2, 0.0, 0.0, 5}};
    StaticArm at_rest(arm, stiff);
    for (int i = 0; i < 50; ++i) {
      VectorXd q(arm.size());
      for (int j = 0; j < arm.size(); ++j) q(j) = random.uniform(-3.0, 3.0);
      const Vector3d point = at_rest.tool_point(q, 5.0, VectorXd::Ones(arm.size()));
      EXPECT_LT((point - in_base(arm, q)).norm(), 1e-9) << name;  // 1e-6 mm
    }
  }
}

TEST(BlindGenerator, ElasticJointSagsByComplianceTimesTorque) {
  Elasticity soft;
  soft.joint_compliance = {2e-5, 0.0};
  StaticArm arm(planar(), soft);
  const Vector3d point = arm.tool_point(Vector2d::Zero(), 10.0, Vector2d::Ones());
  const double moment = g * (0.5 * bar_mass() + 1.5 * bar_mass() + 2.0 * 10.0);
  double angle = 0.0;  // c M cos(angle), by iteration
  for (int i = 0; i < 50; ++i) angle = 2e-5 * moment * std::cos(angle);
  EXPECT_NEAR(point.y(), -2.0 * std::sin(angle), 1e-9);
  EXPECT_NEAR(point.x(), 2.0 * std::cos(angle), 1e-9);
}

TEST(BlindGenerator, SegmentedCantileverConvergesToEulerBernoulli) {
  const double flexibility = 1e-9, length = 1.0;  // so stiff that large deflections play no part
  const double weight = 0.9 * bar_mass() * g / length, lump = 0.1 * bar_mass() * g, tip = 10.0 * g, at = 0.5;
  const double expected = flexibility * (tip * std::pow(length, 3) / 3.0 + weight * std::pow(length, 4) / 8.0 +
                                         lump * at * at * (3.0 * length - at) / 6.0);
  double before = 1.0;
  for (const int segments : {10, 20, 40}) {
    Elasticity soft;
    soft.bars = {{1, flexibility, 0.0, segments}};
    StaticArm arm(planar(), soft);
    const double sag = -arm.tool_point(Vector2d::Zero(), 10.0, Vector2d::Ones()).y();
    const double error = std::abs(sag / expected - 1.0);
    EXPECT_LT(error, 0.3 * before);  // second order: a quarter
    before = error;
  }
  EXPECT_LT(before, 1e-3);
}

TEST(BlindGenerator, TwistedBarTurnsByTorqueTimesLength) {
  Arm arm = nominal_arm("small6");
  Elasticity soft;
  soft.bars = {{1, 0.0, 1e-7, 16}};
  StaticArm at_rest(arm, soft);
  const VectorXd q = VectorXd::Zero(6);
  const Bar bar = bar_of_link(arm, 1);
  const Pieces pieces(arm);
  const Eigen::Isometry3d link = frames(pieces, q)[1];
  const Vector3d axis = link.linear() * bar.direction, point = link * bar.start;
  Vector3d moment = Vector3d::Zero();
  const auto all = frames(pieces, q);
  for (std::size_t j = 2; j < 6; ++j) moment += (all[j] * pieces.com[j] - point).cross(pieces.mass[j] * pieces.gravity);
  moment += (all[6] * pieces.payload_com - point).cross(5.0 * pieces.gravity);
  const double twist = 1e-7 * bar.length * moment.dot(axis);  // the bar's own weight acts in its axis
  const Vector3d expected = twist * axis.cross(all[6].translation() - point);
  const Vector3d moved = at_rest.tool_point(q, 5.0, VectorXd::Ones(6)) - in_base(arm, q);
  const double own = 1e-7 * 0.5 * bar.length * 8.9 * g * 0.02;  // a lump beside the axis
  EXPECT_GT(expected.norm(), 1e-9);
  EXPECT_LT((moved - expected).norm(), 1e-3 * expected.norm() + own);
}

TEST(BlindGenerator, PlayRestsWhereWeightOrApproachPutsIt) {
  Elasticity loose;
  loose.plays = {{0, 1e-4, 0.0, 0.0}};
  StaticArm arm(planar(), loose);
  const auto rest = [](StaticArm& a, double q1, double q2, double side) {
    a.tool_point(Vector2d(q1, q2), 10.0, Vector2d(side, side));
    return a.loose()(0);
  };
  EXPECT_DOUBLE_EQ(rest(arm, 0.0, 0.0, 1.0), -1e-4);   // stretched out: it falls
  EXPECT_DOUBLE_EQ(rest(arm, 1.48, 2.35, 1.0), 1e-4);  // folded over the top: it falls to the other side
  EXPECT_NEAR(rest(arm, -std::numbers::pi / 2.0 - 5e-5, 0.0, 1.0), 5e-5, 1e-10);  // hanging: in between
  loose.plays[0].friction = 1e4;
  StaticArm held(planar(), loose);
  EXPECT_DOUBLE_EQ(rest(held, 0.0, 0.0, 1.0), -1e-4);  // it trails behind the motor
  EXPECT_DOUBLE_EQ(rest(held, 0.0, 0.0, -1.0), 1e-4);
}

// The same play as MuJoCo's own limited joint, left to swing until it rests.
TEST(BlindGenerator, PlayRestsWhereASimulatedOneDoes) {
  Elasticity loose;
  loose.plays = {{0, 1e-2, 0.0, 0.0}};
  std::string text = to_mjcf(planar(), loose);
  const auto add = [&](const std::string& joint, const std::string& what) {
    const std::string from = "<joint name=\"" + joint + "\"";
    text.replace(text.find(from), from.size(), from + what);
  };
  add("q1", " armature=\"1e9\"");  // motors hold still
  add("q2", " armature=\"1e9\"");
  add("p1", " limited=\"true\" range=\"-0.01 0.01\" damping=\"300\"");
  const auto path = std::filesystem::temp_directory_path() / "llmt_blind_play.xml";
  std::ofstream(path) << text;
  char why[500] = "";
  mjModel* model = mj_loadXML(path.string().c_str(), nullptr, why, sizeof why);
  std::filesystem::remove(path);
  ASSERT_NE(model, nullptr) << why;
  mjData* data = mj_makeData(model);
  StaticArm arm(planar(), loose);
  const int p = mj_name2id(model, mjOBJ_JOINT, "p1");
  model->body_mass[mj_name2id(model, mjOBJ_BODY, "payload")] = 10.0;
  for (const auto& [q1, q2] : {std::pair{0.3, 0.4}, {1.5, 2.35}, {-1.5, 0.8}, {1.2, 1.9}}) {
    mj_resetData(model, data);
    data->qpos[mj_name2id(model, mjOBJ_JOINT, "q1")] = q1;
    data->qpos[mj_name2id(model, mjOBJ_JOINT, "q2")] = q2;
    for (int i = 0; i < 2000; ++i) mj_step(model, data);
    arm.tool_point(Vector2d(q1, q2), 10.0, Vector2d::Ones());
    EXPECT_NEAR(data->qpos[p], arm.loose()(0), 1e-3) << q1 << " " << q2;
  }
  mj_deleteData(data);
  mj_deleteModel(model);
}

TEST(BlindGenerator, GeometryErrorsHaveNoLambda) {
  for (const char* name : {"planar", "tx200", "small6"}) {
    llmt::Random random(11);
    Arm described = nominal_arm(name);
    const Arm arm = build(described, random, true);
    const Sessions sessions = make_sessions(arm, {1.0}, {}, random);
    const GeometryFree free(arm, {}, sessions.measured);
    // Position-only six-axis arms have 27 identifiable parameters, parallel axes or not; the planar one 6.
    EXPECT_EQ(free.rank(), arm.planar ? 6 : 27) << name;
    Arm other = arm;
    for (Joint& joint : other.joints) {
      joint.a += 1e-7;
      joint.theta += 2e-7;
    }
    other.tool.xyz.x() += 3e-7;
    const Eigen::MatrixXd moved =
        positions_mm(other, {}, {}, sessions.measured) - positions_mm(arm, {}, {}, sessions.measured);
    EXPECT_LT(free(moved).norm(), 1e-5 * moved.norm()) << name;
  }
}

TEST(BlindGenerator, EveryKindMovesTheToolOfEveryArm) {
  for (const char* name : {"planar", "tx200", "small6"}) {
    std::vector<std::string> kinds = catalogue_kinds(nominal_arm(name));
    for (const std::string& kind : unknown_kinds()) kinds.push_back(kind);
    for (const std::string& kind : kinds) {
      const Case c = make_case({name, kind, "", 77});
      ASSERT_EQ(c.hidden.size(), 1u);
      EXPECT_TRUE(c.measured_mm.allFinite() && c.fresh_mm.allFinite()) << name << " " << kind;
      EXPECT_GT(c.hidden[0].rms_mm, 0.0) << name << " " << kind;
      EXPECT_LT(c.hidden[0].rms_mm, 10.0) << name << " " << kind;
    }
  }
}

TEST(BlindGenerator, SeedsReproduceBytes) {
  const auto text = [](std::uint64_t seed) {
    const Case c = make_case({"small6", "joint_compliance", "outliers", seed});
    return to_csv(c.sessions.measured, c.measured_mm, false, true) + to_csv(c.sessions.fresh, c.fresh_mm, false, true) +
           to_yaml(c.described, c.elastic_joints, c.elastic_values);
  };
  EXPECT_EQ(text(5), text(5));
  EXPECT_NE(text(5), text(6));
}

TEST(BlindGenerator, PlansHaveDisjointSeeds) {
  for (const char* arm : {"planar", "tx200", "small6"}) {
    std::uint64_t last_dev = 0;
    for (const Order& order : plan("dev", arm)) last_dev = std::max(last_dev, order.seed);
    for (const Order& order : plan("frozen", arm)) EXPECT_GT(order.seed, last_dev);
    for (const Order& order : plan("gate", arm)) EXPECT_GT(order.seed, last_dev);
  }
}

}  // namespace
}  // namespace blind
