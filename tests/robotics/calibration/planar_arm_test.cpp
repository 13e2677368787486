// The paper's flexible planar arm (Benes et al. 2022) as a chain plus an effect.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "llmt/robotics/calibration_problem.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

// Flexibility 1/EI in 1/(N m^2) of a round bar: I = pi d^4 / 64.
double round_bar_flexibility(double diameter_mm, double youngs_modulus_gpa) {
  const double inertia_m4 = std::numbers::pi * std::pow(1e-3 * diameter_mm, 4) / 64.0;
  return 1.0 / (1e9 * youngs_modulus_gpa * inertia_m4);
}

// Mass in kg of a round bar.
double round_bar_mass(double diameter_mm, double length_mm, double density_kg_m3) {
  return density_kg_m3 * std::numbers::pi * std::pow(1e-3 * diameter_mm, 2) / 4.0 * 1e-3 * length_mm;
}

Robot flexible(const std::string& effect = "link_bending") {
  Robot robot = read_robot(LLMT_ROBOTS_DIR "/planar_two_link.yaml");
  for (Effect& bending : robot.effects) bending.type = effect;
  return robot;
}

Robot rigid() {
  Robot robot = flexible();
  robot.effects.clear();
  return robot;
}

Measurements exact(const Robot& robot, const Poses& poses) {
  Measurements measurements = measure(robot, poses, 0.0, 1);
  measurements.measured = {true, true, false};
  return measurements;
}

discovery::LeastSquaresProblem paper_problem(const Measurements& measurements) {
  discovery::LeastSquaresProblem problem = calibration_problem(rigid(), measurements);
  for (discovery::Parameter& p : problem.parameters) {
    p.free = p.name == "joint2.a" || p.name == "joint2.b" || p.name == "tool.x" || p.name == "tool.y";
  }
  return problem;
}

TEST(PlanarArm, GridsHaveThePapersCounts) {
  EXPECT_EQ(grid(rigid().chain, 0.1).count(), 1536);
  EXPECT_EQ(grid(rigid().chain, 0.05).count(), 5985);
  EXPECT_EQ(grid(rigid().chain, 0.01).count(), 148680);
}

TEST(PlanarArm, DescriptionHoldsTheRoundBarsOfThePaper) {
  const Robot robot = flexible();
  EXPECT_DOUBLE_EQ(robot.effects[0].values[0], round_bar_flexibility(60.0, 210.0));
  EXPECT_DOUBLE_EQ(robot.chain.joints[1].mass_kg, round_bar_mass(60.0, 1000.0, 7850.0));
}

// An independent bar in the horizontal pose: both links stretched out, every load vertical, statics by hand.
TEST(PlanarArm, HorizontalPoseSagsAsTheTextbookSays) {
  const double ei = 1.0 / round_bar_flexibility(60.0, 210.0);
  const double w = round_bar_mass(60.0, 1000.0, 7850.0) * 9.81;  // N per metre and, for 1 m, N
  const double tip = 98.1;
  const double outer = (tip / 3.0 + w / 8.0) / ei;
  const double moment = tip + 0.5 * w;  // of the outer link and tip mass about the elbow
  const double inner = ((tip + w) / 3.0 + w / 8.0 + moment / 2.0) / ei;
  const double slope = ((tip + w) / 2.0 + w / 6.0 + moment) / ei;
  const Eigen::Vector2d stretched = Eigen::Vector2d::Zero();
  Poses poses{.joints = stretched.transpose(), .covariates = {}};
  const double sag = 2000.0 - positions(flexible(), poses)(0, 1);
  EXPECT_NEAR(sag, 1000.0 * (outer + inner + slope), 1e-3);  // the sine of the slope
  const double reduced = 2000.0 - positions(flexible("link_bending_no_carry_over"), poses)(0, 1);
  EXPECT_NEAR(reduced, 1000.0 * (outer + ((tip + w) / 3.0 + w / 8.0) / ei), 1e-9);
}

TEST(PlanarArm, UprightArmDoesNotBend) {
  Poses poses{.joints = Eigen::RowVector2d(0.5 * std::numbers::pi, 0.0), .covariates = {}};
  EXPECT_LT((positions(flexible(), poses) - positions(rigid(), poses)).norm(), 1e-9);
}

TEST(PlanarArm, RigidErrorsEqualThoseOfThePrototype) {
  const Poses test = grid(rigid().chain, 0.05);
  const ErrorFigures full = error_figures(distances(positions(rigid(), test), exact(flexible(), test)));
  EXPECT_NEAR(full.mean, 2.24, 0.005);
  EXPECT_NEAR(full.max, 5.22, 0.005);
  const ErrorFigures reduced =
      error_figures(distances(positions(rigid(), test), exact(flexible("link_bending_no_carry_over"), test)));
  EXPECT_NEAR(reduced.mean, 0.81, 0.005);
  EXPECT_NEAR(reduced.max, 1.44, 0.005);
}

TEST(PlanarArm, CalibrabilityNumberIsThePapers) {
  const discovery::SolverResult result =
      discovery::solve(paper_problem(exact(flexible(), grid(rigid().chain, 0.1))), {.damping = 0.0});
  EXPECT_NEAR(result.calibrability, 1.78, 0.005);
}

TEST(PlanarArm, ModifiedNewtonConvergesByTheSecondIteration) {
  const Measurements training = exact(flexible(), grid(rigid().chain, 0.1));
  const discovery::SolverResult result = discovery::solve(paper_problem(training), {.damping = 0.0});
  EXPECT_TRUE(result.converged()) << result.reason;
  EXPECT_LE(result.iterations, 2);
  // eq. (12)-(13) are linear in d = [L2, L3, v2, v3]: normal equations written out are the oracle.
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (Eigen::Index i = 0; i < training.count(); ++i) {
    const double a = training.poses.joints(i, 0);
    const double b = a + training.poses.joints(i, 1);
    Eigen::Matrix<double, 2, 4> rows;
    rows << std::cos(a), std::cos(b), std::sin(a), std::sin(b), std::sin(a), std::sin(b), -std::cos(a), -std::cos(b);
    normal += rows.transpose() * rows;
    right += rows.transpose() * (training.positions_mm.row(i).head<2>().transpose() - Eigen::Vector2d(0.0, 2000.0));
  }
  const Eigen::Vector4d d = normal.inverse() * right;
  EXPECT_NEAR(result.parameter("joint2.a").value, d(0), 1e-8);
  EXPECT_NEAR(result.parameter("tool.x").value, d(1), 1e-8);
  EXPECT_NEAR(result.parameter("joint2.b").value, -d(2), 1e-8);
  EXPECT_NEAR(result.parameter("tool.y").value, -d(3), 1e-8);
}

TEST(PlanarArm, CalibrateWithTheSameFourParametersAgrees) {
  const Measurements training = exact(flexible(), grid(rigid().chain, 0.1));
  const discovery::SolverResult paper = discovery::solve(paper_problem(training), {.damping = 0.0});
  const Calibration calibration =
      calibrate(rigid(), training,
                {.only = {"joint2.a", "joint2.b", "tool.x", "tool.y"}, .prior_length_mm = 0.0, .prior_angle_deg = 0.0});
  EXPECT_LT((calibration.result.values - paper.values).norm(), 1e-6);
}

TEST(PlanarArm, FlexibilityOfBothLinksIsRecoveredFromNothing) {
  const Robot truth = flexible();
  Robot start = truth;
  for (Effect& bending : start.effects) bending.values = {0.0};
  const Measurements seen = measure(truth, random_poses(truth.chain, 60, 3), 0.01, 4);
  const Calibration calibration = calibrate(start, seen, {.only = {"link_bending@joint1", "link_bending@joint2"}});
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  for (std::size_t e = 0; e < 2; ++e) {
    const std::string name = "link_bending@joint" + std::to_string(e + 1) + ".flexibility";
    EXPECT_NEAR(calibration.robot.effects[e].values[0], truth.effects[e].values[0],
                4.0 * calibration.result.standard_error(name));
    EXPECT_LT(calibration.result.standard_error(name), 1e-7);  // of 7.5e-6
  }
}

TEST(PlanarArm, EffectColumnsOfTheJacobianEqualDifferences) {
  const Robot robot = flexible();
  const discovery::LeastSquaresProblem problem =
      calibration_problem(robot, measure(robot, random_poses(robot.chain, 10, 5), 0.0, 6));
  Eigen::VectorXd values(std::ssize(problem.parameters));
  for (Eigen::Index k = 0; k < values.size(); ++k) values(k) = problem.parameters[k].value;
  const Eigen::MatrixXd analytic = problem.jacobian(values);
  const Eigen::MatrixXd difference = discovery::difference_jacobian(problem, values);
  // First-order displacements of an arm that turns by 6 mrad: equal up to the square of that angle and the like.
  EXPECT_LT((analytic.rightCols(2) - difference.rightCols(2)).norm(), 1e-3 * difference.rightCols(2).norm());
  const Eigen::Index geometry = values.size() - 2;
  EXPECT_LT((analytic.leftCols(geometry) - difference.leftCols(geometry)).norm(),
            1e-2 * difference.leftCols(geometry).norm());
}

// Eq. (16)-(19). The bound is the target for the tree with at most 93 + 75 leaves; here a smaller one, so a looser
// bound.
TEST(PlanarArm, CorrectionRemovesMostOfTheRest) {
  const Measurements training = exact(flexible(), grid(rigid().chain, 0.1));
  const Measurements test = exact(flexible(), grid(rigid().chain, 0.05));
  const Calibration calibration = calibrate(rigid(), training, {.only = {"joint2.a", "joint2.b", "tool.x", "tool.y"}});
  FitOptions options;
  options.significance = 1.0;
  options.max_leaves = 40;
  options.folds.count = 0;
  const CorrectedRobot corrected{calibration.robot, fit_correction(calibration.robot, training, options).model};
  const double before = distances(positions(calibration.robot, test.poses), test).mean();
  const double after = distances(positions(corrected, test.poses), test).mean();
  EXPECT_LT(after, 0.15 * before);
}

}  // namespace
}  // namespace llmt::robotics
