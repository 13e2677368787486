#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/correction.hpp"
#include "robotics/observations.hpp"

namespace llmt::robotics {
namespace {

// Errors of the geometry of the joints: distances over fresh poses between the arms from flange to base, as they are
// after the frames have been fitted.
double fresh_error_mm(const Robot& truth, const Robot& found, std::uint64_t seed) {
  Robot plain = truth;
  plain.chain.bases.clear();
  plain.chain.tools.clear();
  Robot own = found;
  own.chain.bases.clear();
  own.chain.tools.clear();
  const Measurements fresh = measure(plain, random_poses(truth.chain, 300, seed), 0.0, 1);
  return distances(positions(own, fresh.poses), fresh).mean();
}

Robot with_targets(Robot truth) {
  truth.chain.tool.xyz_mm = {90.0, 10.0, 120.0};
  truth.chain.tools = {{"t2", {.xyz_mm = {-70.0, 80.0, 100.0}}}, {"t3", {.xyz_mm = {10.0, -90.0, 160.0}}}};
  return truth;
}

TEST(ObservationsCalibration, SeveralTargetsAndSessionsAreRecoveredWithoutNoise) {
  const Robot nominal = ur_like();
  Robot truth = with_targets(perturbed(nominal, 0.5, 0.1, 11));
  truth.chain.bases = {{"b", {.xyz_mm = {1500.0, -800.0, 200.0}, .rpy_deg = {5.0, -12.0, 160.0}}}};
  truth.chain.tools.push_back({"b", {.xyz_mm = {40.0, 60.0, 130.0}}});
  const Measurements first =
      read_off(truth, looked_at(random_poses(truth.chain, 60, 12), {{}, {.tool = "t2"}, {.tool = "t3"}}), 0.0, 1);
  const Measurements second =
      read_off(truth, looked_at(random_poses(truth.chain, 60, 13), {{.base = "b", .tool = "b"}}), 0.0, 1);
  const Measurements all = joined(first, second);
  const Calibration calibration = calibrate(nominal, all);
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  EXPECT_LT(distances(positions(calibration.robot, all.poses), all).maxCoeff(), 1e-4);
  EXPECT_LT(fresh_error_mm(truth, calibration.robot, 14), 1e-4);
  EXPECT_EQ(calibration.robot.chain.bases.size(), 1u);
  EXPECT_EQ(calibration.robot.chain.tools.size(), 3u);
}

// Three targets make the directions of the last axis visible, which one on or near it hardly does, and every point is
// measured with noise of its own.
TEST(ObservationsCalibration, ThreeTargetsDetermineTheArmBetterThanOne) {
  double of_one = 0.0;
  double of_three = 0.0;
  for (std::uint64_t seed = 20; seed < 30; ++seed) {
    const Robot truth = with_targets(perturbed(ur_like(), 0.5, 0.1, seed));
    const Poses poses = random_poses(truth.chain, 40, seed + 100);
    const Measurements one = read_off(truth, looked_at(poses, {{}}), 0.05, seed + 200);
    const Measurements three =
        read_off(truth, looked_at(poses, {{}, {.tool = "t2"}, {.tool = "t3"}}), 0.05, seed + 200);
    of_one += fresh_error_mm(truth, calibrate(ur_like(), one).robot, seed + 300);
    of_three += fresh_error_mm(truth, calibrate(ur_like(), three).robot, seed + 300);
  }
  // sqrt(3) by the noise alone, less the parameters of two more targets.
  EXPECT_LT(of_three, of_one / 1.4);
}

TEST(ObservationsCalibration, SessionsShareTheGeometry) {
  double alone = 0.0;
  double together = 0.0;
  for (std::uint64_t seed = 40; seed < 50; ++seed) {
    Robot truth = perturbed(ur_like(), 0.5, 0.1, seed);
    truth.chain.bases = {{"b", {.xyz_mm = {1500.0, -800.0, 200.0}, .rpy_deg = {5.0, -12.0, 160.0}}}};
    truth.chain.tools = {{"b", {.xyz_mm = {40.0, 60.0, 130.0}}}};
    const Measurements first = read_off(truth, looked_at(random_poses(truth.chain, 30, seed + 100), {{}}), 0.05, seed);
    const Measurements second = read_off(
        truth, looked_at(random_poses(truth.chain, 30, seed + 200), {{.base = "b", .tool = "b"}}), 0.05, seed + 300);
    alone += fresh_error_mm(truth, calibrate(ur_like(), first).robot, seed + 400);
    together += fresh_error_mm(truth, calibrate(ur_like(), joined(first, second)).robot, seed + 400);
  }
  EXPECT_LT(together, 0.9 * alone);
}

TEST(ObservationsCalibration, OrientationsAreFittedWithTheirOwnNoise) {
  const Robot nominal = ur_like();
  Robot truth = perturbed(nominal, 0.5, 0.1, 60);
  truth.chain.tool.rpy_deg = {10.0, -20.0, 70.0};
  const Poses poses = random_poses(truth.chain, 80, 61);
  Measurements seen = read_off(truth, poses, 0.05, 62);
  Random random(63);
  constexpr double mrad = 0.2;
  seen.orientation.kind = Orientation::Kind::quaternion;
  seen.orientation.values.resize(poses.count(), 4);
  const std::vector<Pose> tools = tool_poses(truth, poses);
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    const Eigen::Vector3d turn = 1e-3 * mrad * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const Eigen::Quaterniond q(Eigen::AngleAxisd(turn.norm(), turn.normalized()) * tools[i].rotation);
    seen.orientation.values.row(i) << q.w(), q.x(), q.y(), q.z();
  }
  const Measurements both = with_orientations(seen, nominal.chain);
  const Calibration calibration = calibrate(nominal, both);
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  EXPECT_NEAR(calibration.noise_mm, 0.05, 0.01);
  EXPECT_NEAR(calibration.orientation_noise_mrad, mrad, 0.03);
  EXPECT_LT(fresh_error_mm(truth, calibration.robot, 64), fresh_error_mm(truth, calibrate(nominal, seen).robot, 64));
  const CalibrationReport report = report_calibration(nominal, both, {.folds = 4});
  EXPECT_EQ(report.geometric.held_out_mm.size(), poses.count());
  // The mean length of a vector of three normal numbers is 1.6 sigma.
  EXPECT_NEAR(report.geometric.held_out_mrad.mean(), 1.6 * mrad, 0.25 * mrad);
}

TEST(ObservationsCalibration, DistancesFromAFixedPointIdentifyTheArm) {
  const Robot nominal = mdh_like();
  Robot truth = perturbed(nominal, 0.5, 0.1, 70);
  truth.chain.base = {.xyz_mm = {1200.0, 300.0, -100.0}};
  const Observation ball_bar{.reading = Reading::distance};
  const Measurements seen = read_off(truth, looked_at(random_poses(truth.chain, 200, 71), {ball_bar}), 0.01, 72);
  const Calibration calibration = calibrate(nominal, seen);
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  const Measurements fresh = read_off(truth, looked_at(random_poses(truth.chain, 200, 73), {ball_bar}), 0.0, 74);
  EXPECT_LT(distances(positions(calibration.registered, fresh.poses), fresh).mean(), 10.0);
  EXPECT_LT(distances(positions(calibration.robot, fresh.poses), fresh).mean(), 0.01);
}

// Half of the readings are ten times as noisy, and the file says so: weighed by that, they do no harm.
TEST(ObservationsCalibration, StatedStandardDeviationsWeighTheReadings) {
  double weighed = 0.0;
  double alike = 0.0;
  for (std::uint64_t seed = 80; seed < 90; ++seed) {
    const Robot truth = perturbed(ur_like(), 0.5, 0.1, seed);
    const Measurements good = measure(truth, random_poses(truth.chain, 40, seed + 1), 0.02, seed + 2);
    const Measurements bad = measure(truth, random_poses(truth.chain, 40, seed + 3), 0.2, seed + 4);
    Measurements all = joined(good, bad);
    alike += fresh_error_mm(truth, calibrate(ur_like(), all).robot, seed + 5);
    all.poses.covariates["sigma_um"] = Eigen::VectorXd::Constant(80, 20.0);
    all.poses.covariates["sigma_um"].tail(40).setConstant(200.0);
    const Calibration calibration = calibrate(ur_like(), all);
    EXPECT_LT(calibration.noise_mm, 0.015);  // nothing is left beside what is stated
    weighed += fresh_error_mm(truth, calibration.robot, seed + 5);
  }
  EXPECT_LT(weighed, 0.5 * alike);
}

// The tool is turned by what the correction is to learn, a smooth function of two joints.
TEST(ObservationsCalibration, TheCorrectionLearnsOrientations) {
  Robot robot = ur_like();
  const Poses poses = random_poses(robot.chain, 400, 91);
  const Poses seen_by_three = looked_at(poses, {{}, {.tool = "t2"}, {.tool = "t3"}});
  robot = with_targets(robot);
  Measurements seen = read_off(robot, seen_by_three, 0.0, 1);
  const auto turn_at = [](const Eigen::RowVectorXd& q) {
    return Eigen::Vector3d(1e-3 * std::sin(q(1)), 2e-3 * std::cos(q(2)), 0.0);
  };
  const Eigen::MatrixXd flange = [&] {
    Poses own = seen.poses;
    for (Observation& view : own.observations) view.tool = "";
    return positions(robot, own);
  }();
  for (Eigen::Index i = 0; i < seen.count(); ++i) {
    const Eigen::Vector3d arm = (seen.positions_mm.row(i) - flange.row(i)).transpose();
    seen.positions_mm.row(i) += turn_at(seen.poses.joints.row(i)).cross(arm).transpose();
  }
  const FitResult fitted = fit_correction(robot, seen, {});
  const CorrectedRobot corrected{robot, fitted.model};
  const double before = distances(positions(robot, seen.poses), seen).mean();
  EXPECT_LT(distances(positions(corrected, seen.poses), seen).mean(), 0.3 * before);
  double missed = 0.0;
  const std::vector<Pose> plain = tool_poses(robot, poses);
  const std::vector<Pose> tools = tool_poses(corrected, poses);
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    const Eigen::Vector3d turn = turn_at(poses.joints.row(i));
    const Eigen::Matrix3d truth = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * plain[i].rotation;
    missed += Eigen::AngleAxisd(tools[i].rotation.transpose() * truth).angle() / static_cast<double>(poses.count());
  }
  EXPECT_LT(missed, 0.5e-3);  // 1.6e-3 without
}

// What is not measured is not zero: it takes no part.
TEST(ObservationsCalibration, TheCorrectionOfPlanesInTwoSessionsKeepsToWhatWasMeasured) {
  Robot robot = ur_like();
  robot.chain.bases = {{"b", {.xyz_mm = {1500.0, -800.0, 200.0}, .rpy_deg = {5.0, -12.0, 160.0}}}};
  robot.chain.tools = {{"t2", {.xyz_mm = {-70.0, 80.0, 100.0}}}};
  for (const std::vector<Observation>& views :
       {std::vector<Observation>{{}, {.tool = "t2"}}, std::vector<Observation>{{}}}) {
    std::vector<Observation> others = views;
    for (Observation& view : others) view.base = "b";
    Measurements seen = joined(read_off(robot, looked_at(random_poses(robot.chain, 100, 201), views), 0.0, 1),
                               read_off(robot, looked_at(random_poses(robot.chain, 100, 202), others), 0.0, 2));
    seen.measured = {true, true, false};
    for (Eigen::Index i = 0; i < seen.count(); ++i) seen.positions_mm(i, 0) += 0.3 * std::sin(seen.poses.joints(i, 1));
    seen.positions_mm.col(2).setZero();
    const CorrectedRobot corrected{robot, fit_correction(robot, seen, {}).model};
    EXPECT_LT(distances(positions(corrected, seen.poses), seen).mean(),
              distances(positions(robot, seen.poses), seen).mean())
        << views.size();
  }
}

// A second target at one pose alone must not cost all other poses.
TEST(ObservationsCalibration, TheCorrectionLearnsFromAllPosesWhereFewHaveSeveralTargets) {
  Robot robot = with_targets(ur_like());
  const Poses poses = random_poses(robot.chain, 200, 211);
  Measurements seen = joined(read_off(robot, looked_at(poses, {{}}), 0.0, 1),
                             read_off(robot, looked_at(select(poses, {0}), {{}, {.tool = "t2"}}), 0.0, 2));
  for (Eigen::Index i = 0; i < seen.count(); ++i) seen.positions_mm(i, 0) += 0.3 * std::sin(seen.poses.joints(i, 1));
  const CorrectedRobot corrected{robot, fit_correction(robot, seen, {}).model};
  EXPECT_LT(distances(positions(corrected, seen.poses), seen).mean(), 0.05);
}

TEST(ObservationsCalibration, TargetsOfAPoseShareOneOrientation) {
  const Robot robot = with_targets(ur_like());
  Measurements seen = read_off(robot, looked_at(random_poses(robot.chain, 5, 221), {{}, {.tool = "t2"}}), 0.0, 1);
  seen.orientation.kind = Orientation::Kind::quaternion;
  seen.orientation.values.resize(10, 4);
  const std::vector<Pose> tools = tool_poses(robot, seen.poses);
  for (Eigen::Index i = 0; i < 10; ++i) {
    const Eigen::Quaterniond q(tools[i - i % 2].rotation);
    seen.orientation.values.row(i) << q.w(), q.x(), q.y(), q.z();
  }
  const Measurements both = with_orientations(seen, robot.chain);
  EXPECT_EQ(orientation_rows(both.poses).size(), 5u);
  EXPECT_EQ(position_rows(both.poses).size(), 10u);
}

}  // namespace
}  // namespace llmt::robotics
