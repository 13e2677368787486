#include <fmt/format.h>
#include <gtest/gtest.h>

#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

// Two joints, the second prismatic.
Robot two() {
  Robot robot = make_robot(Convention::dh, {{90, 0, 100, 0}, {0, 0, 0, 0}});
  robot.chain.joints[1].type = JointType::prismatic;
  robot.chain.joints[1].limits = {0.0, 300.0};
  return robot;
}

std::string message_of(const std::string& text) {
  try {
    parse_measurements(text, "m.csv", two());
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

void expect_message(const std::string& text, const std::string& part) {
  const std::string message = message_of(text);
  EXPECT_TRUE(message.starts_with("m.csv:1:")) << message;
  EXPECT_NE(message.find(part), std::string::npos) << message;
}

TEST(MeasurementFile, UnitsBecomeRadiansAndMillimetres) {
  const Measurements m = parse_measurements("q1_deg,q2_m,x_m,y_um,z_mm\n180,0.1,1,2000,3\n", "m.csv", two());
  EXPECT_DOUBLE_EQ(m.poses.joints(0, 0), std::numbers::pi);
  EXPECT_DOUBLE_EQ(m.poses.joints(0, 1), 100.0);
  EXPECT_TRUE(m.positions_mm.row(0).isApprox(Eigen::RowVector3d(1000.0, 2.0, 3.0)));
}

TEST(MeasurementFile, ColumnsMayStandInAnyOrderAndSomeCoordinatesBeAbsent) {
  const Measurements m = parse_measurements("y_mm,q2_mm,x_mm,q1_rad\n2,20,1,0.5\n", "m.csv", two());
  EXPECT_EQ(m.poses.joints(0, 1), 20.0);
  EXPECT_EQ(m.positions_mm(0, 1), 2.0);
  EXPECT_FALSE(m.measured[2]);
}

TEST(MeasurementFile, CovariatesAndOrientationAreKeptAndTheRestIsListed) {
  const Measurements m = parse_measurements(
      "q1_deg,q2_mm,x_mm,rx_deg,ry_deg,rz_deg,payload_kg,temp_C,dir1,tau2_Nm,pose,remark\n1,2,3,4,5,6,7,8,-1,9,3,"
      "good\n",
      "m.csv", two());
  EXPECT_EQ(m.poses.covariates.at("payload_kg")(0), 7.0);
  EXPECT_EQ(m.poses.covariates.at("dir1")(0), -1.0);
  EXPECT_EQ(m.poses.covariates.size(), 5u);
  EXPECT_EQ(m.orientation.values, Eigen::RowVector3d(4.0, 5.0, 6.0));
  EXPECT_EQ(m.unused_columns, std::vector<std::string>{"remark"});
  const Measurements q = parse_measurements("q1_deg,q2_mm,x_mm,qw,qx,qy,qz\n1,2,3,1,0,0,0\n", "m.csv", two());
  EXPECT_EQ(q.orientation.kind, Orientation::Kind::quaternion);
  EXPECT_EQ(q.orientation.values, Eigen::RowVector4d(1.0, 0.0, 0.0, 0.0));
}

TEST(MeasurementFile, MissingPointsWrittenAsZerosAreLeftOutWithTheirLines) {
  const Measurements m =
      parse_measurements("q1_deg,q2_mm,x_mm,y_mm,z_mm\n1,2,3,4,5\n1,2,0,0,0\n1,2,0,4,0\n1,2,0,0,0\n", "m.csv", two());
  EXPECT_EQ(m.count(), 2);
  ASSERT_EQ(m.warnings.size(), 1u);
  EXPECT_NE(m.warnings[0].words({}).find("2 of 4 points"), std::string::npos);
  EXPECT_NE(m.warnings[0].words({}).find("lines 3, 5"), std::string::npos);
  EXPECT_THROW(parse_measurements("q1_deg,q2_mm,x_mm\n1,2,0\n", "m.csv", two()), std::runtime_error);
}

TEST(MeasurementFile, MistakesInTheHeaderSayWhatToWrite) {
  expect_message("q1,q2_mm,x_mm\n1,2,3\n", "column \"q1\" has no unit: write q1_deg or q1_rad");
  expect_message("q1_deg,q2_mm,x\n1,2,3\n", "column \"x\" has no unit: write x_m or x_mm or x_um");
  expect_message("q1_deg,q2_mm,x_mm,rx\n1,2,3,4\n", "column \"rx\" has no unit: write rx_deg or rx_rad");
  expect_message("q1_deg,q2_mm,x_inch\n1,2,3\n", "unit \"inch\" is not known");
  expect_message("q1_deg,q2_deg,x_mm\n1,2,3\n", "column \"q2_deg\": unit \"deg\" does not suit, write q2_m or q2_mm");
  expect_message("q1_deg,q1_rad,q2_mm,x_mm\n1,2,3,4\n", "are the same quantity");
  expect_message("q1_deg,x_mm\n1,2\n", "has 2 joints, there is no column q2_m or q2_mm");
  expect_message("q1_deg,q2_mm,q3_deg,x_mm\n1,2,3,4\n", "column \"q3_deg\": robot \"arm\" has 2 joints");
  expect_message("q1_deg,q2_mm\n1,2\n", "no measured position");
}

TEST(MeasurementFile, CellsThatAreNoNumbersNameTheirLine) {
  EXPECT_TRUE(message_of("q1_deg,q2_mm,x_mm\n1,2,3\n1,abc,3\n").starts_with("m.csv:3"));
  EXPECT_TRUE(message_of("q1_deg,q2_mm,x_mm\n1,2,3\n1,2\n").starts_with("m.csv:3"));
}

TEST(MeasurementFile, WritingAndReadingKeepsEveryBit) {
  Measurements m = simulate(two(), {.poses = 50, .noise_um = 10.0, .seed = 3});
  m.poses.covariates["payload_kg"] = Eigen::VectorXd::LinSpaced(50, 0.0, 1.0);
  m.orientation.values = Eigen::MatrixXd::Random(50, 3);
  const Measurements again = parse_measurements(to_csv(m, two()), "m.csv", two());
  EXPECT_EQ(again.poses.joints, m.poses.joints);
  EXPECT_EQ(again.positions_mm, m.positions_mm);
  EXPECT_EQ(again.poses.covariates, m.poses.covariates);
  EXPECT_EQ(again.orientation.values, m.orientation.values);
}

// Names like those of the columns by number: what is written is read, and what may mean two joints is refused.
TEST(MeasurementFile, JointsMayBeCalledByNumbersOfOthers) {
  for (const auto& [first, second] : {std::pair("joint", "q1"), {"q0", "q1"}, {"q2", "q3"}}) {
    Robot robot = two();
    robot.chain.joints[0].name = first;
    robot.chain.joints[1].name = second;
    const Measurements written = simulate(robot, {.poses = 5, .seed = 3});
    EXPECT_EQ(parse_measurements(to_csv(written, robot), "m.csv", robot).poses.joints, written.poses.joints) << first;
    const std::string by_name = fmt::format("{}_deg,{}_mm,x_mm,y_mm,z_mm\n180,7,1,2,3\n", first, second);
    EXPECT_EQ(parse_measurements(by_name, "m.csv", robot).poses.joints(0, 1), 7.0) << first;
  }
  Robot exchanged = two();
  exchanged.chain.joints[0].name = "q2";
  exchanged.chain.joints[1].name = "q1";
  EXPECT_THROW(parse_measurements(to_csv(simulate(exchanged, {.poses = 5}), exchanged), "m.csv", exchanged),
               std::runtime_error);
}

TEST(Simulation, PosesKeepTheLimitsAndNoiseHasItsSize) {
  const Measurements m = simulate(two(), {.poses = 2000, .noise_um = 50.0, .seed = 4});
  EXPECT_GE(m.poses.joints.col(1).minCoeff(), 0.0);
  EXPECT_LT(m.poses.joints.col(1).maxCoeff(), 300.0);
  EXPECT_GT(m.poses.joints.col(1).maxCoeff(), 290.0);
  const Eigen::MatrixXd noise = m.positions_mm - positions(two(), m.poses);
  EXPECT_NEAR(noise.norm() / std::sqrt(6000.0), 0.05, 4.0 * 0.05 / std::sqrt(12000.0));
}

TEST(Simulation, SeedsDecideAndAreIndependentOfNoise) {
  const Measurements a = simulate(two(), {.poses = 10, .seed = 5});
  EXPECT_EQ(a.poses.joints, simulate(two(), {.poses = 10, .noise_um = 10.0, .seed = 5}).poses.joints);
  EXPECT_NE(a.poses.joints, simulate(two(), {.poses = 10, .seed = 6}).poses.joints);
  EXPECT_THROW(simulate(two(), {.poses = 0}), std::invalid_argument);
  Robot endless = two();
  endless.chain.joints[1].limits.reset();
  EXPECT_THROW(simulate(endless), std::invalid_argument);
}

}  // namespace
}  // namespace llmt::robotics
