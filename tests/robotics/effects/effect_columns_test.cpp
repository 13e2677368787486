// Columns that effects look at: read, derived, made up for simulation; and effects that are formulas of them.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "llmt/robotics/simulation.hpp"
#include "robotics/effects.hpp"

namespace llmt::robotics {
namespace {

TEST(EffectColumns, MovesAreDifferencesInMeasuringOrder) {
  const std::string csv =
      "q1_deg,q2_mm,x_mm,order,qmeas1_deg,qmeas2_mm\n"
      "30,5,1,3,30.5,5.25\n"
      "10,1,1,1,10,1\n"
      "20,3,0,2,20,3\n"
      "60,9,2,4,60,9\n";
  Robot robot = make_robot(Convention::dh, {{0, 1, 0, 0}, {0, 1, 0, 0}});
  robot.chain.joints[1].type = JointType::prismatic;
  const Measurements measurements = parse_measurements(csv, "m.csv", robot);
  // The point of the third row is missing, but the arm was there.
  ASSERT_EQ(measurements.count(), 3);
  const auto& covariates = measurements.poses.covariates;
  EXPECT_LT((covariates.at("move1_rad") - degree * Eigen::Vector3d(10.0, 0.0, 30.0)).norm(), 1e-12);
  EXPECT_LT((covariates.at("move2_mm") - Eigen::Vector3d(2.0, 0.0, 4.0)).norm(), 1e-12);
  EXPECT_NEAR(covariates.at("qmeas1_rad")(0), 30.5 * degree, 1e-15);
  EXPECT_EQ(covariates.at("qmeas2_mm")(0), 5.25);
  EXPECT_FALSE(covariates.contains("qmeas1_deg"));
  const std::string written = to_csv(measurements, robot);
  EXPECT_EQ(written.find("move"), std::string::npos) << written;
  EXPECT_NE(written.find("qmeas1_rad"), std::string::npos) << written;
}

TEST(EffectColumns, WithoutOrderTimeTells) {
  Poses poses{.joints = Eigen::Vector3d(1.0, 2.0, 4.0), .covariates = {}};
  const Robot robot = make_robot(Convention::dh, {{0, 1, 0, 0}});
  add_moves(poses, robot.chain);
  EXPECT_TRUE(poses.covariates.empty());
  poses.covariates["time_s"] = Eigen::Vector3d(30.0, 20.0, 10.0);
  add_moves(poses, robot.chain);
  EXPECT_EQ(poses.covariates.at("move1_rad"), Eigen::Vector3d(-1.0, -2.0, 0.0));
}

TEST(EffectColumns, EveryEffectCanBeSimulated) {
  for (Robot robot : {slanted(weighted(ur_like())), slanted(weighted(scara()))}) {
    for (Joint& joint : robot.chain.joints) {
      if (joint.type == JointType::prismatic) joint.limits = {0.0, 200.0};
    }
    const Measurements rigid = simulate(robot, {.poses = 30});
    for (const EffectType& type : effect_types()) {
      if (type.name == "formula" || !suits(type, robot.chain, type.place == EffectPlace::robot ? 0 : 1)) continue;
      Effect effect = make_effect(type, robot.chain, type.place == EffectPlace::robot ? 0 : 1, {}, 20);
      for (double& value : effect.values) value = 1e-4;
      const Measurements measurements = simulate(with_effect(robot, effect), {.poses = 30});
      EXPECT_TRUE(measurements.positions_mm.allFinite()) << type.name;
      EXPECT_EQ(measurements.poses.joints, rigid.poses.joints) << type.name;
      // Temperature at the reference and read-back as commanded say nothing, payload and gravity need something
      // elastic.
      const bool is_neutral = type.family == "thermal_growth" || type.name == "read_back_lag" || type.adjust;
      EXPECT_EQ(measurements.positions_mm == rigid.positions_mm, is_neutral) << type.name;
    }
  }
}

TEST(EffectColumns, MadeUpColumnsAreWhatTheyAreSaidToBe) {
  Robot robot = weighted(ur_like());
  robot.effects = {{"thermal_growth", "", {1e-5}, {23.0}},
                   {"backlash_approach", "joint2", {1e-4}},
                   {"drift", "", {0.1, 0.0, 0.0}, {0.0, 99.0}},
                   {"hysteresis", "joint1", {1e-4}, {0.01}},
                   {"joint_compliance_measured", "joint3", {1e-6}}};
  const Poses poses = simulate(robot, {.poses = 100}).poses;
  EXPECT_EQ(poses.covariates.at("temp_C"), Eigen::VectorXd::Constant(100, 23.0));
  EXPECT_EQ(poses.covariates.at("order")(99), 99.0);
  EXPECT_EQ(poses.covariates.at("move1_rad")(7), poses.joints(7, 0) - poses.joints(6, 0));
  const Eigen::VectorXd& directions = poses.covariates.at("dir2");
  EXPECT_EQ(directions.cwiseAbs(), Eigen::VectorXd::Ones(100));
  EXPECT_LT(std::abs(directions.sum()), 50.0);
  for (Eigen::Index i = 0; i < 5; ++i) {
    EXPECT_NEAR(column_of(poses, "tau3_Nm", i), gravity_by_energy(robot, poses.joints.row(i).transpose(), 7.0, 2),
                1e-5);
  }
}

TEST(EffectColumns, SimulationAtGivenPosesKeepsTheirColumns) {
  const std::string path = (std::filesystem::temp_directory_path() / "llmt_poses_test.csv").string();
  std::ofstream(path) << "q1_rad,q2_rad,temp_C\n0.1,0.2,30\n-1,2,10\n";
  Robot robot = make_robot(Convention::dh, {{0, 1000, 0, 0}, {0, 500, 0, 0}});
  const Poses poses = read_poses(path, robot);
  std::filesystem::remove(path);
  const Measurements cold = simulate(robot, poses);
  robot.effects = {{"thermal_growth", "", {1e-5}, {20.0}}};
  const Measurements warm = simulate(robot, poses);
  EXPECT_EQ(warm.poses.joints, poses.joints);
  EXPECT_LT((warm.positions_mm.row(0) - (1.0 + 1e-4) * cold.positions_mm.row(0)).norm(), 1e-9);
  EXPECT_LT((warm.positions_mm.row(1) - (1.0 - 1e-4) * cold.positions_mm.row(1)).norm(), 1e-9);
}

Effect formula(const std::string& at, const std::string& acts_on, const std::string& text, double value) {
  return {.type = "formula", .at = at, .values = {value}, .formula = {"own", {{acts_on, text}}}};
}

TEST(FormulaEffects, FormulasOfEffectsThatAreThereMoveTheToolAlike) {
  const Robot robot = weighted(ur_like());
  const Poses poses = furnished_poses(robot.chain, 10, 1);
  const auto expect_alike = [&](const Effect& own, const Effect& known) {
    const Eigen::MatrixXd points = positions(with_effect(robot, known), poses);
    EXPECT_LT((positions(with_effect(robot, own), poses) - points).norm(), 1e-9) << known.type;
    EXPECT_GT((positions(robot, poses) - points).norm(), 1e-4) << known.type;
  };
  expect_alike(formula("joint2", "joint", "q2", 1e-4), {"joint_gain", "joint2", {1e-4}});
  expect_alike(formula("joint3", "joint", "tau3", 1e-6), {"joint_compliance", "joint3", {1e-6}});
  expect_alike(formula("joint5", "joint", "q4", 1e-4), {"wrist_coupling", "joint5", {1e-4}});
  expect_alike(formula("joint2", "joint", "-dir2", 1e-4), {"backlash_approach", "joint2", {1e-4}});
  expect_alike(formula("joint2", "joint", "sin(202 * q2)", 1e-4),
               {"transmission_error", "joint2", {0.0, 1e-4}, {202.0}});
  expect_alike(formula("", "y", "time_s / 3600", 0.2), {"drift", "", {0.0, 0.2, 0.0}, {0.0, 3600.0}});
}

TEST(FormulaEffects, ColumnsInAFormulaAreReadFromTheFile) {
  Robot robot = make_robot(Convention::dh, {{0, 1000, 0, 0}});
  const std::string csv = "q1_rad,x_mm,humidity\n0,1000,0.5\n1,500,0.75\n";
  EXPECT_EQ(parse_measurements(csv, "m.csv", robot).unused_columns, std::vector<std::string>{"humidity"});
  EXPECT_EQ(parse_measurements(csv, "m.csv", robot, {"humidity"}).poses.covariates.at("humidity")(1), 0.75);
  const Robot plain = robot;
  robot.effects = {formula("", "x", "humidity", 2.0)};
  const Measurements measurements = parse_measurements(csv, "m.csv", robot);
  const Eigen::MatrixXd change = positions(robot, measurements.poses) - positions(plain, measurements.poses);
  EXPECT_NEAR(change(1, 0), 1.5, 1e-12);
}

}  // namespace
}  // namespace llmt::robotics
