#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>

#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/robot_check.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "robotics/touches.hpp"

namespace llmt::robotics {
namespace {

TEST(Spheres, ShowTheArmAndTheirRadius) {
  const Robot truth = real_arm();
  constexpr double radius_mm = 40.0;
  const Measurements exact = on_spheres(truth, 80, radius_mm, 0.0, false);
  ASSERT_GT(exact.count(), 200);
  const Calibration calibration = calibrate(ur_like(), exact);
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  const double before_mm = shape_error_mm(truth, ur_like());
  EXPECT_LT(shape_error_mm(truth, calibration.robot), 1e-3 * before_mm);
  const std::map<std::string, std::string> fixed = reasons_of(calibration);
  EXPECT_EQ(fixed.at("joint2.a"), "no reading shows the scale");
  EXPECT_EQ(fixed.at("base@sphere ball 2.rx"), "a sphere has no angles");
  EXPECT_FALSE(fixed.contains("base@sphere ball 2.radius"));
  for (const NamedFrame& base : calibration.robot.chain.bases) EXPECT_NEAR(base.radius_mm, radius_mm, 1e-3);
}

TEST(Spheres, LeaveTheErrorOfTheTouch) {
  const Robot truth = real_arm();
  constexpr double sigma_mm = 0.02;
  const Calibration rough = calibrate(ur_like(), on_spheres(truth, 80, 40.0, sigma_mm, false));
  EXPECT_NEAR(rough.robot.calibration->noise_mm, sigma_mm, 0.1 * sigma_mm);
  EXPECT_LT(shape_error_mm(truth, rough.robot), sigma_mm);
}

// Of an arm whose longest length is not as described.
TEST(Spheres, OfAGivenRadiusShowTheScale) {
  const Robot truth = perturbed(ur_like(), 0.5, 0.05, 3);
  const double off_mm = truth.chain.joints[1].a_mm - ur_like().chain.joints[1].a_mm;
  ASSERT_GT(std::abs(off_mm), 0.1);
  const Calibration exact = calibrate(ur_like(), on_spheres(truth, 80, 300.0, 0.0, true));
  EXPECT_LT(shape_error_mm(truth, exact.robot), 1e-3 * shape_error_mm(truth, ur_like()));
  EXPECT_FALSE(reasons_of(exact).contains("joint2.a"));
  // The larger the ball, the better the scale. What the fit says of it is true.
  constexpr double sigma_mm = 0.02;
  const std::map<double, double> bounds_mm = {{15.0, 0.08}, {40.0, 0.04}, {300.0, 0.024}};
  double before_mm = std::numeric_limits<double>::infinity();
  for (const auto& [radius_mm, bound_mm] : bounds_mm) {
    const Robot rough = calibrate(ur_like(), on_spheres(truth, 80, radius_mm, sigma_mm, true)).robot;
    EXPECT_LT(shape_error_mm(truth, rough), bound_mm) << radius_mm;
    const auto scale = std::ranges::find(rough.identified, "joint2.a", &IdentifiedParameter::name);
    EXPECT_LT(std::abs(rough.chain.joints[1].a_mm - truth.chain.joints[1].a_mm), 3.0 * scale->standard_error.value());
    EXPECT_LT(*scale->standard_error, before_mm) << radius_mm;
    before_mm = *scale->standard_error;
  }
  const Robot unscaled = calibrate(ur_like(), on_spheres(truth, 80, 300.0, sigma_mm, false)).robot;
  EXPECT_GT(shape_error_mm(truth, unscaled), 0.5 * std::abs(off_mm));
}

TEST(Spheres, LetDiscoverAndCheckKeepTheScale) {
  const Robot truth = real_arm();
  constexpr double sigma_mm = 0.02;
  for (const bool is_given : {false, true}) {
    const Measurements readings = on_spheres(truth, 80, 40.0, sigma_mm, is_given);
    const Discovery found = discover(ur_like(), readings);
    EXPECT_EQ(found.answer, discovery::Answer::nothing_missing);
    EXPECT_NEAR(found.noise_mm, sigma_mm, 0.2 * sigma_mm);
    const CorrectedRobot calibrated = {.robot = calibrate(ur_like(), readings).robot, .correction = {}};
    const RobotCheck check = check_robot(calibrated, readings, {.same_session = true});
    EXPECT_TRUE(check.still_good);
    EXPECT_TRUE(check.moved.empty());
  }
}

TEST(Spheres, AreReadAndWrittenAndHaveNothingBesideThem) {
  const Robot robot = make_robot(Convention::dh, {{0, 300, 0, 0}});
  const Measurements m = parse_measurements("q1_rad,sphere\n1,a\n2,the other\n", "m.csv", robot);
  EXPECT_EQ(m.poses.observations[1].base, "sphere the other");
  EXPECT_EQ(measured_rows(m), (std::vector<Eigen::Index>{0, 3}));
  const Measurements known = parse_measurements("q1_rad,sphere,radius_m\n1,a,0.02\n2,the other,0.03\n", "m.csv", robot);
  EXPECT_EQ(known.poses.observations[1].base, "known sphere the other");
  EXPECT_EQ(known.positions_mm(1, 0), 30.0);
  for (const Measurements& read : {m, known}) {
    const std::string written = to_csv(read, robot);
    const Measurements again = parse_measurements(written, "w.csv", robot);
    EXPECT_EQ(to_csv(again, robot), written);
    EXPECT_EQ(again.poses.observations[1].base, read.poses.observations[1].base);
  }
  Robot described = with_frames(robot, m.poses);
  described.chain.bases[1].radius_mm = 12.5;
  const std::string yaml = to_yaml(described);
  EXPECT_EQ(parse_robot(yaml, "r.yaml").chain.bases[1].radius_mm, 12.5) << yaml;

  EXPECT_EQ(refused(robot, "q1_rad,x_mm,sphere\n1,2,a\n"),
            "m.csv:1: points on spheres have no other readings beside them: fit them one after the other");
  EXPECT_EQ(refused(robot, "q1_rad,plane,sphere\n1,a,a\n"),
            "m.csv:1: points on planes have no other readings beside them: fit them one after the other");
  EXPECT_EQ(refused(robot, "q1_rad,sphere\n1,a\n1,\n"), "m.csv:3: column \"sphere\": the name is missing");
  EXPECT_EQ(refused(robot, "q1_rad,sphere,radius_mm\n1,a,0\n"),
            "m.csv:2: column \"radius_mm\": a radius must be above 0");
  EXPECT_NE(refused(robot, "q1_rad,sphere,radius\n1,a,3\n").find("column \"radius\" has no unit"), std::string::npos);
  // Without spheres a column of that name means nothing, as before.
  const Measurements points = parse_measurements("q1_rad,x_mm,radius\n1,2,3\n", "m.csv", robot);
  EXPECT_EQ(points.unused_columns, (std::vector<std::string>{"radius"}));
}

}  // namespace
}  // namespace llmt::robotics
