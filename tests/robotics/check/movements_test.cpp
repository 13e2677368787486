// The tests behind a check, where the answer is known: columns at right angles, closed forms of the F distribution.
#include "check/movements.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "check/bad_readings.hpp"
#include "check/f_tail.hpp"
#include "check/moved_parameters.hpp"
#include "check/shared_error.hpp"
#include "llmt/robotics/robot_check.hpp"
#include "robotics/check/checked_arm.hpp"

namespace llmt::robotics {
namespace {

// Forty residuals of 1 and -1 in turn; columns are the first three of them, times `units`.
MovementProblem axes_problem(const Eigen::Vector3d& first, const Eigen::Vector3d& units) {
  MovementProblem problem;
  problem.jacobian = Eigen::MatrixXd::Zero(40, 3);
  problem.jacobian.topRows(3) = units.asDiagonal();
  problem.residuals.resize(40);
  for (Eigen::Index i = 0; i < 40; ++i) problem.residuals(i) = i % 2 == 0 ? 1.0 : -1.0;
  problem.residuals.head(3) = first;
  problem.covariance = Eigen::MatrixXd::Zero(3, 3);
  problem.suspects = {{"a", {0}}, {"b", {1}}, {"c", {2}}};
  return problem;
}

// F of one coordinate is its square. Of three tests the best counts three times, then of two the next one.
TEST(FindMovements, TheStrongestComesFirstAndEachIsTestedAmongThoseLeft) {
  const Movements found = find_movements(axes_problem({8.0, 10.0, 1.0}, {1.0, 2.0, 1.0}));
  ASSERT_EQ(found.found.size(), 2U);
  EXPECT_EQ(found.found[0].suspect, 1U);
  EXPECT_NEAR(found.found[0].probability, 3.0 * f_tail(100.0, 1.0, 37.0), 1e-12);
  EXPECT_NEAR(found.found[0].changes.at(0), 5.0, 1e-9);
  EXPECT_NEAR(found.found[0].standard_errors.at(0), 0.5, 1e-9);
  EXPECT_TRUE(found.found[0].or_else.empty());
  EXPECT_EQ(found.found[1].suspect, 0U);
  EXPECT_NEAR(found.found[1].probability / (2.0 * f_tail(64.0, 1.0, 37.0)), 1.0, 1e-9);
  EXPECT_NEAR(found.found[1].changes.at(0), 8.0, 1e-9);
  const Movements other_way = find_movements(axes_problem({10.0, 8.0, 1.0}, {1.0, 1.0, 1.0}));
  ASSERT_EQ(other_way.found.size(), 2U);
  EXPECT_EQ(other_way.found[0].suspect, 0U);
}

TEST(FindMovements, NoiseIsThatOfWhatNoColumnReachesWhateverItsUnit) {
  for (const double unit : {1.0, 1e-9, 1e9}) {
    const MovementProblem problem = axes_problem({8.0, 10.0, 1.0}, {1.0, unit, 1.0});
    const auto [noise, freedom] = unexplained(problem.jacobian, problem.residuals);
    EXPECT_EQ(freedom, 37.0);
    EXPECT_NEAR(noise, 1.0, 1e-12);
  }
}

// Exact data are as good as the rounding of positions of metres, 1e-9 mm.
TEST(FindMovements, ExactDataHaveTheErrorOfTheirRounding) {
  MovementProblem problem = axes_problem({8.0, 0.0, 0.0}, {1.0, 1.0, 1.0});
  problem.residuals.tail(37).setZero();
  const Movements found = find_movements(problem);
  ASSERT_EQ(found.found.size(), 1U);
  EXPECT_NEAR(found.found[0].standard_errors.at(0), 1e-9, 1e-15);
}

// The mean length of normal noise in three coordinates is 2 sqrt(2 / pi).
TEST(RobotCheckLimits, AreATenthAboveTheAccuracyAtLeast) {
  CorrectedRobot robot = checked::calibrated(1);
  CalibrationRecord& record = *robot.robot.calibration;
  const Measurements today = checked::measured(checked::another_day(checked::arm()), 40, 5);
  record.held_out_mm = 0.05;
  record.held_out_sd_mm = 0.0;
  EXPECT_NEAR(check_robot(robot, today).limit_mm, 1.1 * 0.05, 1e-12);
  record.held_out_mm.reset();
  const RobotCheck by_noise = check_robot(robot, today);
  EXPECT_TRUE(by_noise.accuracy_is_of_noise);
  EXPECT_NEAR(by_noise.accuracy_mm, record.noise_mm * 2.0 * std::sqrt(2.0 / M_PI), 1e-6 * record.noise_mm);
  EXPECT_THROW(check_robot(robot, today, {.accuracy_mm = std::numeric_limits<double>::infinity()}),
               std::invalid_argument);
}

// Where the base is fitted anew it is no suspect, seen or not.
TEST(RobotCheckLimits, ABaseThatIsFittedAnewIsNoSuspect) {
  const RobotCheck anew =
      check_robot(checked::calibrated(1), checked::measured(checked::another_day(checked::arm()), 40, 5));
  EXPECT_FALSE(anew.unseen.empty());
  for (const std::string& name : anew.unseen) EXPECT_FALSE(is_of_base(name) || name == "base") << name;
}

// Values without correlations are as independent ones.
TEST(RobotCheckLimits, AFileWithoutCorrelationsHasIndependentValues) {
  CorrectedRobot robot = checked::calibrated(1);
  Robot knocked = checked::another_day(checked::arm());
  knocked.chain.joints[2].theta_deg += 0.02;
  const Measurements today = checked::measured(knocked, 40, 101);
  Eigen::MatrixXd& correlations = robot.robot.calibration->correlations;
  correlations.setIdentity();
  const RobotCheck independent = check_robot(robot, today);
  correlations.resize(0, 0);
  const RobotCheck without = check_robot(robot, today);
  ASSERT_FALSE(without.moved.empty());
  ASSERT_EQ(without.moved.size(), independent.moved.size());
  EXPECT_EQ(without.moved[0].name, independent.moved[0].name);
  EXPECT_DOUBLE_EQ(without.moved[0].changes[0].by, independent.moved[0].changes[0].by);
  EXPECT_DOUBLE_EQ(without.moved[0].changes[0].standard_error, independent.moved[0].changes[0].standard_error);
}

TEST(RobotCheckLimits, TheGeometryEndsWhereTheEffectsBegin) {
  const CorrectedRobot robot = checked::calibrated(1);
  const Measurements today = checked::measured(checked::arm(), 40, 5);
  const Linearised linear = linearised(robot, robot.robot, today, {.same_session = true});
  ASSERT_LT(linear.geometric, std::ssize(linear.parameters));
  EXPECT_TRUE(linear.parameters[linear.geometric].name.starts_with("joint_compliance"));
  EXPECT_FALSE(linear.parameters[linear.geometric - 1].name.starts_with("joint_compliance"));
  // The columns are derivatives by the parameters over their scales: a step of the first one is seen.
  Robot moved = robot.robot;
  const double step = 1e-3;
  moved.chain.base.xyz_mm.x() += step;
  EXPECT_EQ(linear.parameters[0].name, "base.x");
  const Eigen::MatrixXd seen = (positions(moved, today.poses) - positions(robot.robot, today.poses)).transpose() / step;
  const Eigen::VectorXd column = linear.problem.jacobian.col(0) / linear.parameters[0].scale;
  EXPECT_LT((seen.reshaped() - column).cwiseAbs().maxCoeff(), 1e-6);
}

// An effect of two values, and behind it those of one.
TEST(RobotCheckLimits, EveryValueOfAnEffectTakesPart) {
  Robot robot = checked::arm();
  robot.effects.insert(robot.effects.begin(), make_effect(effect_type("transmission_error"), robot.chain, 1));
  robot.effects.front().values = {3e-4, 0.0};
  const Linearised linear =
      linearised({robot, {}}, robot, checked::measured(checked::arm(), 40, 5), {.same_session = true});
  ASSERT_EQ(std::ssize(linear.parameters) - linear.geometric, 4);
  EXPECT_TRUE(linear.parameters[linear.geometric].name.starts_with("transmission_error@joint2"));
  EXPECT_TRUE(linear.parameters[linear.geometric + 1].name.starts_with("transmission_error@joint2"));
  EXPECT_TRUE(linear.parameters[linear.geometric + 2].name.starts_with("joint_compliance@joint2."));
  EXPECT_TRUE(linear.parameters[linear.geometric + 3].name.starts_with("joint_compliance@joint3."));
}

// Thirty readings of three coordinates about one mean, three of them far off.
TEST(BadReadings, NoMoreThanAskedForAreTakenOut) {
  const Eigen::MatrixXd jacobian = Eigen::MatrixXd::Ones(90, 1);
  Eigen::VectorXd residuals(90);
  std::vector<Eigen::Index> reading_of;
  for (Eigen::Index i = 0; i < 90; ++i) {
    residuals(i) = std::sin(1.7 * static_cast<double>(i));
    reading_of.push_back(i / 3);
  }
  residuals(0) += 40.0;
  residuals(34) += 60.0;
  residuals(89) -= 50.0;
  const auto sorted = [&](Eigen::Index most) {
    std::vector<Eigen::Index> found = bad_readings(jacobian, residuals, reading_of, most, 0.001);
    std::ranges::sort(found);
    return found;
  };
  EXPECT_TRUE(sorted(0).empty());
  EXPECT_EQ(sorted(1), (std::vector<Eigen::Index>{11}));
  EXPECT_EQ(sorted(2), (std::vector<Eigen::Index>{11, 29}));
  EXPECT_EQ(sorted(6), (std::vector<Eigen::Index>{0, 11, 29}));
}

// P(F > f) of 2 and n degrees of freedom is (1 + 2 f / n)^(-n / 2); F and 1 / F change places.
TEST(FTail, HasItsClosedFormOfTwoAndIsSymmetric) {
  for (const double n : {1.0, 7.0, 40.0, 3000.0}) {
    for (const double f : {1e-8, 1e-3, 0.1, 0.9, 1.0, 2.5, 30.0}) {
      EXPECT_NEAR(f_tail(f, 2.0, n), std::pow(1.0 + 2.0 * f / n, -0.5 * n), 1e-12) << f << " " << n;
      EXPECT_NEAR(f_tail(f, 5.0, n) + f_tail(1.0 / f, n, 5.0), 1.0, 1e-12) << f << " " << n;
    }
  }
}

}  // namespace
}  // namespace llmt::robotics
