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

// The cells of a row's joints, each with a comma behind it, and the name of what it touches.
std::string joints_of(const Measurements& touched, Eigen::Index row) {
  std::string text;
  for (const double q : touched.poses.joints.row(row)) text += fmt::format("{},", q);
  return text;
}

std::string touched_by(const Measurements& touched, Eigen::Index row) {
  const std::string& base = touched.poses.observations[row].base;
  return base.substr(base.find(is_socket(base) ? "s" : "ball", base.find(' ')));
}

// A length between two sockets, stated in every row of one of them, is one kind of reading more.
TEST(Sockets, ALengthBetweenThemShowsTheScale) {
  Robot truth = perturbed(ur_like(), 0.5, 0.05, 3);
  truth.chain.joints[1].a_mm = ur_like().chain.joints[1].a_mm - 2.0;  // the longest length is wrong, too
  constexpr double sigma_mm = 0.02;
  const Measurements touched = in_sockets(truth, 60, sigma_mm);
  std::string with_length = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,socket,from,distance_mm\n";
  const double length_mm = (Eigen::RowVector3d(450, 250, 300) - Eigen::RowVector3d(-350, 400, 150)).norm();
  for (Eigen::Index i = 0; i < touched.count(); ++i) {
    const std::string name = touched_by(touched, i);
    with_length += joints_of(touched, i) + name + (name == "s2" ? fmt::format(",s1,{}\n", length_mm) : ",,\n");
  }
  const Measurements readings = parse_measurements(with_length, "m.csv", truth);
  EXPECT_GT(readings.count(), touched.count() + 30);
  const Calibration alone = calibrate(ur_like(), touched);
  const Calibration known = calibrate(ur_like(), readings);
  EXPECT_TRUE(known.result.converged()) << known.result.reason;
  EXPECT_FALSE(reasons_of(known).contains("joint2.a"));
  EXPECT_GT(shape_error_mm(truth, alone.robot), 0.5);
  EXPECT_LT(shape_error_mm(truth, known.robot), 0.03);
  EXPECT_NEAR(known.robot.calibration->noise_mm, sigma_mm, 0.15 * sigma_mm);
}

TEST(Sockets, ALengthThatEndsNowhereIsRefused) {
  const Robot robot = make_robot(Convention::dh, {{0, 300, 0, 0}});
  const std::string head = "q1_rad,socket,from,distance_mm\n1,a,,\n";
  EXPECT_EQ(refused(robot, head + "2,b,a,\n"), "m.csv:3: column \"from\": the distance from there is missing");
  EXPECT_EQ(refused(robot, head + "2,b,,500\n"),
            "m.csv:3: column \"from\": the socket is missing that the distance is measured from");
  EXPECT_EQ(refused(robot, head + "2,b,c,500\n"), "m.csv:3: column \"from\": no row touches this socket");
  EXPECT_EQ(refused(robot, head + "2,b,b,500\n"),
            "m.csv:3: column \"from\": the length ends at this socket: name the other one");
  EXPECT_EQ(refused(robot, head + "2,b,a,-5\n"), "m.csv:3: column \"distance_mm\": a distance must be above 0");
  EXPECT_EQ(refused(robot, head + "2,b,a,500\n"), "no error");
  EXPECT_NE(refused(robot, "q1_rad,socket,distance_mm\n1,a,3\n").find("a column from names the socket"),
            std::string::npos);
}

TEST(Sockets, SpheresStandBesideThemInOneFile) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.05, 3);
  const Measurements sockets = in_sockets(truth, 40, 0.01);
  const Measurements spheres = on_spheres(truth, 60, 40.0, 0.01, true);
  std::string both = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,socket,sphere,radius_mm\n";
  for (Eigen::Index i = 0; i < sockets.count(); ++i) both += joints_of(sockets, i) + touched_by(sockets, i) + ",,\n";
  for (Eigen::Index i = 0; i < spheres.count(); ++i) {
    both += fmt::format("{},{},40\n", joints_of(spheres, i), touched_by(spheres, i));
  }
  const Calibration calibration = calibrate(ur_like(), parse_measurements(both, "m.csv", truth));
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  EXPECT_LT(shape_error_mm(truth, calibration.robot), 0.03);
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
