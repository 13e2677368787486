// What is made of measured rows: moves, stands, orientations as readings and as angles.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/random.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/orientation.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

// Two joints, the second prismatic.
Robot turn_and_slide() {
  Robot robot = make_robot(Convention::dh, {{90, 0, 100, 0}, {0, 0, 0, 0}});
  robot.chain.joints[1].type = JointType::prismatic;
  return robot;
}

TEST(Moves, AreDifferencesInTheOrderOfTheReadings) {
  for (const std::string order : {"order", "time_s"}) {
    const Measurements m = parse_measurements("q1_rad,q2_mm,x_mm," + order + "\n0.5,10,1,3\n0.1,40,2,1\n0.2,70,3,2\n",
                                              "m.csv", turn_and_slide());
    ASSERT_TRUE(m.poses.covariates.contains("move1_rad"));
    ASSERT_TRUE(m.poses.covariates.contains("move2_mm"));
    EXPECT_LT((m.poses.covariates.at("move1_rad") - Eigen::Vector3d(0.3, 0.0, 0.1)).norm(), 1e-15);
    EXPECT_LT((m.poses.covariates.at("move2_mm") - Eigen::Vector3d(-60.0, 0.0, 30.0)).norm(), 1e-12);
  }
  const Measurements unordered = parse_measurements("q1_rad,q2_mm,x_mm\n1,2,3\n", "m.csv", turn_and_slide());
  EXPECT_TRUE(unordered.poses.covariates.empty());
}

TEST(PoseTable, HasAPoseOnceForAllItsTargets) {
  const PoseTable table =
      parse_pose_table("q1_rad,q2_mm,target\n0.5,10,a\n0.5,10,b\n0.6,10,a\n0.5,10,c\n", "p.csv", turn_and_slide());
  Eigen::MatrixXd expected(2, 2);
  expected << 0.5, 10.0, 0.6, 10.0;
  EXPECT_EQ(table.poses.joints, expected);
  EXPECT_EQ(parse_pose_table("q1_rad,q2_mm\n0.5,10\n0.5,10\n", "p.csv", turn_and_slide()).poses.count(), 2);
}

TEST(MeasuredOrientations, AreReadingsBehindThePositionsOneForAllTargetsOfAPose) {
  const std::string header = "q1_rad,q2_mm,x_mm,y_mm,z_mm,qw,qx,qy,qz";
  // A quarter turn about z, seen with two targets; then a half turn about x.
  const Measurements m =
      parse_measurements(header + ",target\n0.5,10,1,2,3,1,0,0,1,a\n0.5,10,4,5,6,1,0,0,1,b\n0.6,10,7,8,9,0,1,0,0,a\n",
                         "m.csv", turn_and_slide());
  const Measurements both = with_orientations(m, turn_and_slide().chain);
  ASSERT_EQ(both.count(), 5);
  EXPECT_EQ(both.positions_mm.topRows(3), m.positions_mm);
  EXPECT_TRUE(both.positions_mm.bottomRows(2).isZero(0.0));
  EXPECT_EQ(both.poses.joints(3, 0), 0.5);
  EXPECT_EQ(both.poses.joints(4, 0), 0.6);
  for (Eigen::Index row = 0; row < 5; ++row) {
    EXPECT_EQ(both.poses.observations[row].reading, row < 3 ? Reading::position : Reading::orientation) << row;
  }
  Eigen::Matrix3d quarter;
  quarter << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  EXPECT_LT((both.poses.observations[3].reference - quarter).norm(), 1e-15);
  const Eigen::Matrix3d half = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  EXPECT_LT((both.poses.observations[4].reference - half).norm(), 1e-15);
}

TEST(MeasuredOrientations, OfRowsWithoutObservationsAreOneEach) {
  std::string text = "q1_rad,q2_mm,x_mm,y_mm,z_mm,qw,qx,qy,qz\n";
  for (int k = 0; k < 7; ++k) text += std::to_string(k) + ",10,1,2,3,1,0,0,0\n";
  const Measurements m = parse_measurements(text, "m.csv", turn_and_slide());
  ASSERT_TRUE(m.poses.observations.empty());
  const Measurements both = with_orientations(m, turn_and_slide().chain);
  ASSERT_EQ(both.count(), 14);
  ASSERT_EQ(both.poses.observations.size(), 14U);
  for (Eigen::Index row = 0; row < 14; ++row) EXPECT_EQ(both.poses.observations[row].stand, row % 7) << row;
  const Measurements without =
      parse_measurements("q1_rad,q2_mm,x_mm,y_mm,z_mm\n1,2,3,4,5\n", "m.csv", turn_and_slide());
  EXPECT_EQ(without.orientation.values.rows(), 0);
  EXPECT_THROW(with_orientations(without, turn_and_slide().chain), std::invalid_argument);
}

TEST(OrientationAngles, OfEveryOrderOfTheAxesGiveTheRotationBack) {
  Random random(1);
  for (const std::string kind : {"intrinsic_", "extrinsic_"}) {
    for (const std::string letters : {"xyz", "xzy", "yxz", "yzx", "zxy", "zyx"}) {
      for (int k = 0; k < 20; ++k) {
        Eigen::Vector3d angles_deg;
        for (double& angle : angles_deg) angle = random.uniform(-85.0, 85.0);
        // About the fixed axes one after the other is about the moved axes in the other order.
        Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
        for (const char letter : letters) {
          const int axis = letter - 'x';
          const Eigen::Matrix3d turn =
              Eigen::AngleAxisd(angles_deg(axis) * std::numbers::pi / 180.0, Eigen::Vector3d::Unit(axis))
                  .toRotationMatrix();
          rotation = kind == "intrinsic_" ? Eigen::Matrix3d(rotation * turn) : Eigen::Matrix3d(turn * rotation);
        }
        const Orientation found = to_orientation({rotation}, kind + letters);
        EXPECT_LT((found.values.row(0).transpose() - angles_deg).norm(), 1e-9) << kind << letters;
        EXPECT_LT((rotations_of(found, kind + letters)[0] - rotation).norm(), 1e-12) << kind << letters;
      }
    }
  }
}

// The column of reference points may have another name, beside others that have.
TEST(ReferencePoints, StandInTheColumnThatAMapNames) {
  const ColumnMap map = parse_column_map("columns: {Axis: q1_deg, A nest: reference}\n", "map");
  const std::string text = "Axis,x_mm,y_mm,z_mm,remark,A nest\n,1,2,3,,a\n5,2,3,4,,\n";
  const Robot robot = make_robot(Convention::dh, {{0, 300, 0, 0}});
  const Measurements m = parse_measurements(text, "m.csv", robot, {}, DecimalMark::point, map);
  EXPECT_EQ(m.count(), 1);
  EXPECT_EQ(m.positions_mm.row(0), Eigen::RowVector3d(2.0, 3.0, 4.0));
  ASSERT_FALSE(m.warnings.empty());
  EXPECT_EQ(
      m.warnings[0].words({}),
      "m.csv: the reference points were read in one round only, which shows no drift: read them again at the end");
}

}  // namespace
}  // namespace llmt::robotics
