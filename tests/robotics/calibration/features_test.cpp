#include <gtest/gtest.h>

#include <map>
#include <set>

#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/robot_check.hpp"
#include "robotics/touches.hpp"

namespace llmt::robotics {
namespace {

TEST(Sockets, AloneShowTheArmWithoutAnyInstrument) {
  const Robot truth = real_arm();
  const Measurements readings = in_sockets(truth, 60, 0.0);
  ASSERT_GT(readings.count(), 120);
  const Calibration calibration = calibrate(ur_like(), readings);
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  const double before_mm = shape_error_mm(truth, ur_like());
  EXPECT_GT(before_mm, 0.3);
  EXPECT_LT(shape_error_mm(truth, calibration.robot), 1e-3 * before_mm);
  const std::map<std::string, std::string> fixed = reasons_of(calibration);
  EXPECT_EQ(fixed.at("joint2.a"), "no reading shows the scale");
  EXPECT_EQ(fixed.at("base@socket s2.rx"), "a socket has no angles");
}

// What is left is how badly the balls seat, and the arm is known better than that.
TEST(Sockets, LeaveTheErrorOfTheirSeats) {
  const Robot truth = real_arm();
  constexpr double sigma_mm = 0.02;
  const Calibration calibration = calibrate(ur_like(), in_sockets(truth, 60, sigma_mm));
  EXPECT_NEAR(calibration.robot.calibration->noise_mm, sigma_mm, 0.1 * sigma_mm);
  EXPECT_LT(shape_error_mm(truth, calibration.robot), sigma_mm);
}

TEST(Sockets, StandBesideMeasuredPointsInOneFile) {
  const Robot robot = make_robot(Convention::dh, {{0, 300, 0, 0}});
  const std::string text =
      "q1_rad,x_mm,y_mm,z_mm,socket,target\n"
      "1,2.5,3.5,4.5,,t1\n"
      "2,,,,floor,t1\n";
  const Measurements m = parse_measurements(text, "m.csv", robot);
  ASSERT_EQ(m.count(), 2);
  const std::vector<Observation>& seen = m.poses.observations;
  EXPECT_EQ(seen[0].base + seen[1].base, "socket floor");
  EXPECT_EQ(seen[0].tool, seen[1].tool);
  const std::string written = to_csv(m, robot);
  EXPECT_EQ(to_csv(parse_measurements(written, "w.csv", robot), robot), written);

  EXPECT_EQ(refused(robot, "q1_rad,x_mm,y_mm,z_mm,socket\n1,2,3,4,floor\n"),
            "m.csv:2: there are a measured point and a socket: leave the cells of one of them empty");
  EXPECT_EQ(refused(robot, "q1_rad,x_mm,y_mm,z_mm,socket\n1,2,3,4,\n2,,,,\n"),
            "m.csv:3: there is neither a measured point nor a socket");
  EXPECT_EQ(refused(robot, "q1_rad,x_mm,y_mm,socket\n1,2,3,\n2,,,a\n"),
            "m.csv:1: beside sockets, points need all of x, y and z");
}

TEST(Planes, ShowTheArmWithoutAnyInstrument) {
  const Robot truth = real_arm();
  const double before_mm = shape_error_mm(truth, ur_like());
  const Measurements exact = on_planes(truth, 80, 0.0);
  ASSERT_GT(exact.count(), 150);
  const Calibration calibration = calibrate(ur_like(), exact);
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  EXPECT_LT(shape_error_mm(truth, calibration.robot), 1e-3 * before_mm);
  const std::map<std::string, std::string> fixed = reasons_of(calibration);
  EXPECT_EQ(fixed.at("joint2.a"), "no reading shows the scale");
  EXPECT_TRUE(fixed.contains("base@plane face 1.rz"));
  EXPECT_FALSE(fixed.contains("base@plane face 1.z"));

  constexpr double sigma_mm = 0.02;
  const Calibration rough = calibrate(ur_like(), on_planes(truth, 80, sigma_mm));
  EXPECT_NEAR(rough.robot.calibration->noise_mm, sigma_mm, 0.1 * sigma_mm);
  EXPECT_LT(shape_error_mm(truth, rough.robot), 3.0 * sigma_mm);
}

TEST(Sockets, LeaveOutWhatTheyTakeUp) {
  const Robot truth = real_arm();
  const Measurements readings = in_sockets(truth, 30, 0.02);
  EXPECT_EQ(reasons_of(calibrate(ur_like(), readings)).at("joint1.theta"), "base and sockets take it up");
  // Sockets stand on the column that carries the arm, too: its height is no scale.
  Robot tall = ur_like();
  tall.chain.joints[0].d_mm = 1480.0;
  EXPECT_EQ(reasons_of(calibrate(tall, readings)).at("joint2.a"), "no reading shows the scale");
  // A length that is known is one.
  CalibrationOptions known;
  known.fixed = {"joint3.a"};
  for (const auto& [name, why] : reasons_of(calibrate(ur_like(), readings, known))) {
    EXPECT_NE(why, "no reading shows the scale") << name;
  }
}

// Types of effects that a discovery speaks of.
std::set<std::string> types_in(const Discovery& found) {
  std::set<std::string> types;
  const auto add = [&](const std::string& label) { types.insert(label.substr(0, label.find_first_of("@["))); };
  for (const Visible& entry : found.visible) add(entry.what);
  for (const discovery::UntestableCause& cause : found.not_testable) add(cause.what);
  for (const FoundEffect& effect : found.effects) types.insert(effect.effect.type);
  return types;
}

TEST(Sockets, LetDiscoverSpeakOfNoInstrument) {
  const Robot truth = real_arm();
  const Discovery found = discover(ur_like(), in_sockets(truth, 60, 0.02), {}, {.correct = false});
  EXPECT_EQ(found.answer, discovery::Answer::nothing_missing);
  const std::set<std::string> types = types_in(found);
  EXPECT_TRUE(types.contains("eccentricity"));
  for (const std::string& type : types) EXPECT_FALSE(effect_type(type).of_measuring) << type;
}

TEST(Planes, LetDiscoverAndCheckKeepTheScale) {
  const Robot truth = real_arm();
  constexpr double sigma_mm = 0.02;
  const Measurements readings = on_planes(truth, 80, sigma_mm);
  const Discovery found = discover(ur_like(), readings);
  EXPECT_EQ(found.answer, discovery::Answer::nothing_missing);
  EXPECT_NEAR(found.noise_mm, sigma_mm, 0.2 * sigma_mm);
  const Robot calibrated = calibrate(ur_like(), readings).robot;
  const RobotCheck check = check_robot({.robot = calibrated, .correction = {}}, readings, {.same_session = true});
  EXPECT_TRUE(check.still_good);
  EXPECT_TRUE(check.moved.empty());
}

TEST(Touch, IsNotReadByAnInstrument) {
  Robot robot = ur_like();
  robot.chain.base.xyz_mm = {3000.0, 500.0, 0.0};
  robot.chain.bases = {{"socket s", {}}, {"plane p", {}}, {"sphere b", {}, 20.0}};
  Poses poses = random_poses(robot.chain, 4, 8);
  poses.observations = {
      {}, {.base = "socket s"}, {.base = "plane p"}, {.base = "sphere b", .reading = Reading::distance}};
  const Eigen::MatrixXd without = positions(robot, poses);
  robot.effects = {{.type = "instrument_range", .at = "", .values = {0.5}}};
  const Eigen::VectorXd change = (positions(robot, poses) - without).rowwise().norm();
  EXPECT_NEAR(change(0), 0.5, 1e-9);
  EXPECT_EQ(change.tail(3), Eigen::Vector3d::Zero());
}

TEST(Planes, AreReadAndWrittenAndHaveNothingBesideThem) {
  const Robot robot = make_robot(Convention::dh, {{0, 300, 0, 0}});
  const Measurements m = parse_measurements("q1_rad,plane\n1,floor\n2,the wall\n", "m.csv", robot);
  ASSERT_EQ(m.count(), 2);
  EXPECT_EQ(m.poses.observations[1].base, "plane the wall");
  EXPECT_EQ(measured_rows(m), (std::vector<Eigen::Index>{2, 5}));
  const std::string written = to_csv(m, robot);
  EXPECT_EQ(to_csv(parse_measurements(written, "w.csv", robot), robot), written);
  EXPECT_EQ(refused(robot, "q1_rad,x_mm,plane\n1,2,floor\n"),
            "m.csv:1: points on planes have no other readings beside them: fit them one after the other");
  EXPECT_EQ(refused(robot, "q1_rad,plane\n1,floor\n1,\n"), "m.csv:3: column \"plane\": the name is missing");
}

}  // namespace
}  // namespace llmt::robotics
