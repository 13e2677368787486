// Calibration of real arms from public measurements. Bounds are the project's targets, mean position errors in mm.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/robot_file.hpp"

namespace llmt::robotics {
namespace {

struct Arm {
  Robot robot;
  Measurements measurements;
};

Arm load_arm(const std::string& robot_name, const std::string& data_name) {
  Arm arm{.robot = read_robot(LLMT_ROBOTS_DIR "/" + robot_name + ".yaml"), .measurements = {}};
  arm.measurements = read_measurements(LLMT_DATA_DIR "/robots/" + data_name + ".csv", arm.robot);
  return arm;
}

double held_out_mean(const Arm& arm, FoldKind kind) {
  return report_calibration(arm.robot, arm.measurements, {.kind = kind}).geometric.held_out_mm.mean();
}

void expect_near_nominal(const Arm& arm, double bound_mm) {
  const Calibration calibration = calibrate(arm.robot, arm.measurements);
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  EXPECT_EQ(calibration.result.rank, 27);
  for (std::size_t j = 0; j < arm.robot.chain.joints.size(); ++j) {
    const Joint& nominal = arm.robot.chain.joints[j];
    const Joint& identified = calibration.robot.chain.joints[j];
    EXPECT_LT(std::abs(identified.a_mm - nominal.a_mm), bound_mm) << nominal.name;
    EXPECT_LT(std::abs(identified.d_mm - nominal.d_mm), bound_mm) << nominal.name;
  }
}

TEST(Ur5, GeometryHoldsOnUnseenPoses) {
  const Arm arm = load_arm("ur5", "ur5_grid");
  EXPECT_LE(held_out_mean(arm, FoldKind::random), 0.105);
  EXPECT_LE(held_out_mean(arm, FoldKind::contiguous), 0.110);
  expect_near_nominal(arm, 5.0);
}

TEST(Ur5, CalibratedOnTheGridHoldsOnRandomPoses) {
  const Arm grid = load_arm("ur5", "ur5_grid");
  const Arm random = load_arm("ur5", "ur5_random");
  const Calibration calibration = calibrate(grid.robot, grid.measurements);
  EXPECT_LE(distances(positions(calibration.robot, random.measurements.poses), random.measurements).mean(), 0.102);
}

TEST(Ur10, SeriesBGeometryHoldsOnUnseenPoses) {
  const Arm arm = load_arm("ur10", "ur10_b");
  EXPECT_LE(held_out_mean(arm, FoldKind::random), 0.400);
  EXPECT_LE(held_out_mean(arm, FoldKind::contiguous), 0.440);
  expect_near_nominal(arm, 5.0);
}

TEST(Ur10, SeriesCGeometryAndTreeHoldOnUnseenPoses) {
  const Arm arm = load_arm("ur10", "ur10_c");
  const CalibrationReport report = report_calibration(arm.robot, arm.measurements, {.correct = true});
  EXPECT_LE(report.geometric.held_out_mm.mean(), 0.440);
  EXPECT_LE(report.corrected->held_out_mm.mean(), 0.260);
  EXPECT_TRUE(report.correction_kept) << report.decision;
  expect_near_nominal(arm, 5.0);
}

TEST(Ur10, SeriesDKeepsItsParametersNearNominal) { expect_near_nominal(load_arm("ur10", "ur10_d"), 5.0); }

TEST(Wam, GeometryHoldsOnUnseenPoses) {
  const Arm arm = load_arm("wam", "wam_grid");
  EXPECT_LE(held_out_mean(arm, FoldKind::random), 2.15);
  EXPECT_LE(held_out_mean(arm, FoldKind::contiguous), 2.70);
  EXPECT_EQ(calibrate(arm.robot, arm.measurements).result.rank, 31);
}

TEST(Wam, CorrectionThatMakesUnseenPosesWorseIsLeftOut) {
  const Arm arm = load_arm("wam", "wam_grid");
  const CalibrationReport report =
      report_calibration(arm.robot, arm.measurements, {.correct = true, .kind = FoldKind::contiguous});
  EXPECT_FALSE(report.correction_kept) << report.decision;
}

}  // namespace
}  // namespace llmt::robotics
