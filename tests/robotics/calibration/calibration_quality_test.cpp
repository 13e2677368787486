#include "llmt/robotics/calibration_quality.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "llmt/robotics/calibration_report.hpp"
#include "robotics/observations.hpp"

namespace llmt::robotics {
namespace {

// The oracle: as many refits as there are poses.
TEST(CalibrationQuality, LeaveOneOutIsWhatRefitsGive) {
  Robot truth = perturbed(ur_like(), 0.5, 0.1, 5);
  truth.chain.tools = {{"t2", {.xyz_mm = {90.0, 20.0, -30.0}}}};
  const Poses poses = random_poses(truth.chain, 30, 6);
  for (const std::vector<Observation>& views : {std::vector<Observation>{{}}, {{}, {.tool = "t2"}}}) {
    const Measurements seen = read_off(truth, looked_at(poses, views), 0.05, 7);
    const CalibrationOptions options{.position_noise_mm = 0.05};
    const Calibration calibration = calibrate(ur_like(), seen, options);
    const Eigen::VectorXd closed = leave_one_out(calibration, seen);
    CalibrationOptions from_here = options;
    from_here.start_as_given = true;
    for (const FixedParameter& fixed : calibration.fixed) from_here.fixed.push_back(fixed.name);
    for (Eigen::Index pose = 0; pose < poses.count(); pose += 5) {
      std::vector<std::size_t> own;
      for (Eigen::Index i = 0; i < seen.count(); ++i) {
        if (seen.poses.observations[i].stand == pose) own.push_back(i);
      }
      // Priors stay around the same values.
      Robot start = calibration.registered;
      start.identified.clear();
      const Calibration without = calibrate(start, without_rows(seen, own), from_here);
      const Eigen::VectorXd refitted = distances(positions(without.robot, seen.poses), seen);
      for (const std::size_t i : own) EXPECT_NEAR(closed(i), refitted(i), 0.02 * refitted(i) + 1e-4) << pose;
    }
  }
}

TEST(CalibrationQuality, DeviationsAreTheErrorsOfManyCalibrations) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.1, 15);
  const Poses use = random_poses(truth.chain, 50, 16);
  const Eigen::MatrixXd true_mm = positions(truth, use);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(use.count());
  constexpr int runs = 60;
  Calibration calibration;
  for (int run = 0; run < runs; ++run) {
    const Measurements seen = measure(truth, random_poses(truth.chain, 60, 17), 0.05, 1000 + run);
    calibration = calibrate(ur_like(), seen);
    squares += (positions(calibration.robot, use) - true_mm).rowwise().squaredNorm() / runs;
  }
  const double predicted = position_deviations(calibration, use).norm();
  // Each of the 60 runs has some 27 independent errors: 3 % or so.
  EXPECT_NEAR(predicted, std::sqrt(squares.sum()), 0.1 * predicted);
}

TEST(CalibrationQuality, CoverageNamesTheJointsAndTheirUncertainty) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.1, 25);
  Poses poses = random_poses(truth.chain, 100, 26);
  poses.joints.col(1) *= 0.2;
  const Calibration calibration = calibrate(ur_like(), measure(truth, poses, 0.05, 27));
  Poses used = poses;
  EXPECT_TRUE(coverage(calibration, poses, used).outside.empty());
  used.joints.topRows(10).col(1).array() += 2.0;
  const Coverage covered = coverage(calibration, poses, used);
  ASSERT_EQ(covered.beyond.size(), 1u);
  EXPECT_EQ(covered.beyond[0].name, "joint2");
  EXPECT_EQ(covered.outside.size(), 10u);
  EXPECT_GT(covered.deviation_outside_mm, 1.5 * covered.deviation_inside_mm);
}

TEST(CalibrationQuality, RepeatsTellTheNoise) {
  const Robot truth = ur_like();
  const Poses once = random_poses(truth.chain, 100, 35);
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < 300; ++i) rows.push_back(i % 100);
  Poses poses = select(once, rows);
  Measurements seen = measure(truth, poses, 0.05, 36);
  EXPECT_FALSE(noise_of_repeats(seen).has_value());
  seen.poses.covariates["pose"] = Eigen::VectorXd::NullaryExpr(300, [](Eigen::Index i) { return double(i % 100); });
  const RepeatNoise noise = noise_of_repeats(seen).value();
  EXPECT_EQ(noise.freedom, 200);
  EXPECT_NEAR(noise.sigma_mm, 0.05, 4.0 * 0.05 / std::sqrt(2.0 * 600.0));
}

TEST(CalibrationQuality, TheLearningCurveFalls) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.1, 45);
  const Measurements seen = measure(truth, random_poses(truth.chain, 200, 46), 0.1, 47);
  const std::vector<LearningPoint> curve = learning_curve(ur_like(), seen);
  ASSERT_GE(curve.size(), 4u);
  EXPECT_EQ(curve.front().poses, 12);
  EXPECT_EQ(curve.back().poses, 160);
  EXPECT_GT(curve.front().held_out_mm, 1.3 * curve.back().held_out_mm);
  EXPECT_LT(curve.front().fitted_mm, curve.back().fitted_mm);
  // With all poses the error is little more than the noise: 0.16 mm is the mean length of 0.1 mm in three coordinates.
  EXPECT_NEAR(curve.back().held_out_mm, 0.16, 0.03);
}

// 200 arms, every free parameter: the true value lies within 1.96 standard errors in 95 % of the cases. A mean of 200
// arms with some 20 independent parameters has a standard deviation of 0.4 %; priors pull a little.
TEST(CalibrationQuality, StandardErrorsHoldTheTruthAtTheNominalRate) {
  int inside = 0;
  int all = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Robot truth = mdh_like();
    Random random(500 + seed);
    // Only what calibration frees differs from the description.
    const std::vector<Eigen::Index> changed = {
        joint_parameter(1, JointParameter::a),     joint_parameter(1, JointParameter::alpha),
        joint_parameter(2, JointParameter::a),     joint_parameter(2, JointParameter::theta),
        joint_parameter(3, JointParameter::alpha), joint_parameter(3, JointParameter::theta),
        joint_parameter(4, JointParameter::a)};
    Eigen::VectorXd values = geometric_values(truth.chain);
    for (const Eigen::Index k : changed) values(k) += 0.2 * random.normal();
    truth.chain = with_geometric_values(truth.chain, values);
    const Measurements seen = measure(truth, random_poses(truth.chain, 60, 1500 + seed), 0.05, 2500 + seed);
    const Calibration calibration = calibrate(mdh_like(), seen);
    for (const Eigen::Index k : changed) {
      const double error = calibration.result.standard_errors(k);
      if (!(error > 0.0)) continue;
      ++all;
      if (std::abs(calibration.result.values(k) - values(k)) <= 1.96 * error) ++inside;
    }
  }
  ASSERT_EQ(all, 1400);
  EXPECT_NEAR(inside / 1400.0, 0.95, 0.02);
}

TEST(CalibrationQuality, GrossErrorsAreLeftOutAndNamed) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.1, 65);
  Measurements seen = measure(truth, random_poses(truth.chain, 80, 66), 0.05, 67);
  seen.positions_mm.row(7) += Eigen::RowVector3d(5.0, 0.0, -3.0);
  seen.positions_mm.row(40) += Eigen::RowVector3d(0.0, 400.0, 0.0);
  const RobustCalibration robust = calibrate_robustly(ur_like(), seen);
  EXPECT_EQ(robust.left_out, (std::vector<std::size_t>{7, 40}));
  EXPECT_NEAR(robust.calibration.noise_mm, 0.05, 0.01);
  EXPECT_GT(calibrate(ur_like(), seen).noise_mm, 1.0);
}

TEST(CalibrationQuality, PriorsOfSingleParametersHoldThem) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.1, 75);
  const Measurements seen = measure(truth, random_poses(truth.chain, 60, 76), 0.05, 77);
  const Calibration held = calibrate(ur_like(), seen, {.priors = {{"joint2.a", 1e-4}, {"joint5", 1e-5}}});
  EXPECT_NEAR(held.result.parameter("joint2.a").value, ur_like().chain.joints[1].a_mm, 1e-3);
  EXPECT_NEAR(held.result.parameter("joint5.alpha").value, ur_like().chain.joints[4].alpha_deg, 1e-4);
  EXPECT_THROW(calibrate(ur_like(), seen, {.priors = {{"joint9", 1.0}}}), std::invalid_argument);
  EXPECT_THROW(calibrate(ur_like(), seen, {.priors = {{"joint2.a", 0.0}}}), std::invalid_argument);
}

// A session that no pose of the fit belongs to gets a base and a tool of its own, and nothing else.
TEST(CalibrationQuality, AnotherSessionIsPlacedBeforeItIsJudged) {
  Robot truth = perturbed(ur_like(), 0.5, 0.1, 85);
  const Calibration calibration = calibrate(ur_like(), measure(truth, random_poses(truth.chain, 80, 86), 0.02, 87));
  Robot later = truth;
  later.chain.base = {.xyz_mm = {-300.0, 900.0, 40.0}, .rpy_deg = {2.0, -3.0, -70.0}};
  later.chain.tool.xyz_mm += Eigen::Vector3d(4.0, -6.0, 3.0);
  const Measurements seen = measure(later, random_poses(truth.chain, 40, 88), 0.02, 89);
  EXPECT_GT(distances(positions(calibration.robot, seen.poses), seen).mean(), 100.0);
  const Robot placed = with_placed_frames(calibration.robot, seen, {});
  EXPECT_LT(distances(positions(placed, seen.poses), seen).mean(), 0.05);
  EXPECT_EQ(placed.chain.joints[2].a_mm, calibration.robot.chain.joints[2].a_mm);
}

// A joint map is no parameter of the calibration: it must not shift the others.
TEST(CalibrationQuality, DeviationsDoNotMindAJointMap) {
  Robot truth = perturbed(ur_like(), 0.5, 0.1, 95);
  const Measurements seen = measure(truth, random_poses(truth.chain, 80, 96), 0.02, 97);
  Robot mapped = ur_like();
  mapped.effects = {{"joint_map", "joint2", {0.0, 0.0, 0.0}, {-1.0, 1.0}}};
  const Poses use = random_poses(truth.chain, 20, 98);
  const Eigen::VectorXd plain = position_deviations(calibrate(ur_like(), seen), use);
  EXPECT_LT((position_deviations(calibrate(mapped, seen), use) - plain).norm(), 1e-6 * plain.norm());
}

// Sessions that no pose of a draw belongs to are placed before they are judged.
TEST(CalibrationQuality, TheLearningCurveOfManySessionsFalls) {
  Robot truth = perturbed(ur_like(), 0.5, 0.1, 105);
  Measurements all;
  for (int session = 0; session < 6; ++session) {
    const std::string name = session == 0 ? "" : "s" + std::to_string(session);
    if (session > 0) truth.chain.bases.push_back({name, {.xyz_mm = {200.0 * session, -300.0, 50.0 * session}}});
    const Measurements own =
        read_off(truth, looked_at(random_poses(truth.chain, 12, 110 + session), {{.base = name}}), 0.05, 120 + session);
    all = session == 0 ? own : joined(all, own);
  }
  const std::vector<LearningPoint> curve = learning_curve(ur_like(), all, {}, 2, 1);
  for (const LearningPoint& point : curve) EXPECT_LT(point.held_out_mm, 20.0);  // hundreds with a wrong base
  EXPECT_LT(curve.back().held_out_mm, 0.3);
}

// Readings that state a large standard deviation are no outliers.
TEST(CalibrationQuality, StatedNoiseIsNoGrossError) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.1, 125);
  Measurements seen = joined(measure(truth, random_poses(truth.chain, 80, 126), 0.02, 127),
                             measure(truth, random_poses(truth.chain, 20, 128), 0.5, 129));
  seen.poses.covariates["sigma_um"] = Eigen::VectorXd::Constant(100, 20.0);
  seen.poses.covariates["sigma_um"].tail(20).setConstant(500.0);
  seen.positions_mm(3, 0) += 4.0;
  EXPECT_EQ(calibrate_robustly(ur_like(), seen).left_out, std::vector<std::size_t>{3});
}

TEST(CalibrationQuality, TheRecordCountsPosesAndCoordinatesAndItsNoiseIsThatOfTheResiduals) {
  Robot truth = perturbed(ur_like(), 0.5, 0.1, 135);
  truth.chain.tools = {{"t2", {.xyz_mm = {-70.0, 80.0, 100.0}}}};
  Measurements seen = read_off(truth, looked_at(random_poses(truth.chain, 60, 136), {{}, {.tool = "t2"}}), 0.05, 137);
  seen.poses.covariates["sigma_um"] = Eigen::VectorXd::Constant(120, 1000.0);  // far more than it is
  const CalibrationRecord record = *calibrate(ur_like(), seen).robot.calibration;
  EXPECT_EQ(record.poses, 60);
  EXPECT_EQ(record.coordinates, 360);
  EXPECT_NEAR(record.noise_mm, 0.05, 0.006);
}

}  // namespace
}  // namespace llmt::robotics
