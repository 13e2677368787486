#include <fmt/format.h>
#include <gtest/gtest.h>

#include "kinematics/rotations.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/compensation.hpp"
#include "robotics/observations.hpp"

namespace llmt::robotics {
namespace {

// The arm holds a ball in each socket in turn, in `count` poses; where the ball really lies scatters by sigma.
Measurements in_sockets(const Robot& truth, int count, double sigma_mm) {
  const std::vector<Eigen::RowVector3d> centres = {{450, 250, 300}, {-350, 400, 150}, {100, -550, 450}};
  llmt::Random random(7);
  std::string text = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,socket\n";
  for (std::size_t k = 0; k < centres.size(); ++k) {
    Targets targets;
    targets.start = random_poses(truth.chain, count, 50 + k);
    targets.positions_mm = centres[k].replicate(count, 1);
    for (double& value : targets.positions_mm.reshaped()) value += sigma_mm * random.normal();
    const Compensation found = compensate(CorrectedRobot{truth, {}}, targets, {.tolerance_mm = 1e-9});
    for (int i = 0; i < count; ++i) {
      if (found.after_mm(i) > 1e-7) continue;
      for (const double q : found.commands.joints.row(i)) text += fmt::format("{},", q);
      text += fmt::format("s{}\n", k + 1);
    }
  }
  return parse_measurements(text, "sockets.csv", truth);
}

// Mean distance on fresh poses between two arms, whatever their bases.
double shape_error_mm(const Robot& truth, const Robot& found) {
  const Poses fresh = random_poses(truth.chain, 300, 9);
  Robot own = found;
  own.chain.bases.clear();
  const Eigen::MatrixXd to = positions(truth, fresh);
  const Eigen::MatrixXd from = positions(own, fresh);
  const Pose base = kabsch(from, to);
  return ((from * base.rotation.transpose()).rowwise() + base.position_mm.transpose() - to).rowwise().norm().mean();
}

Robot real_arm() {
  Robot truth = perturbed(ur_like(), 0.5, 0.05, 3);
  truth.chain.joints[1].a_mm = ur_like().chain.joints[1].a_mm;  // the longest length: sockets alone show no scale
  return truth;
}

TEST(Sockets, AloneShowTheArmWithoutAnyInstrument) {
  const Robot truth = real_arm();
  const Measurements readings = in_sockets(truth, 60, 0.0);
  ASSERT_GT(readings.count(), 120);
  const Calibration calibration = calibrate(ur_like(), readings);
  EXPECT_TRUE(calibration.result.converged()) << calibration.result.reason;
  const double before_mm = shape_error_mm(truth, ur_like());
  EXPECT_GT(before_mm, 0.3);
  EXPECT_LT(shape_error_mm(truth, calibration.robot), 1e-3 * before_mm);
  std::map<std::string, std::string> fixed;
  for (const FixedParameter& entry : calibration.fixed) fixed[entry.name] = entry.why;
  EXPECT_EQ(fixed.at("joint2.a"), "sockets alone show no scale");
  EXPECT_EQ(fixed.at("base@socket s2.rx"), "a socket has no angles");
}

// What is left is how badly the balls seat, and the arm is not much worse known than that.
TEST(Sockets, LeaveTheErrorOfTheirSeats) {
  const Robot truth = real_arm();
  constexpr double sigma_mm = 0.02;
  const Calibration calibration = calibrate(ur_like(), in_sockets(truth, 60, sigma_mm));
  EXPECT_NEAR(calibration.robot.calibration->noise_mm, sigma_mm, 0.1 * sigma_mm);
  EXPECT_LT(shape_error_mm(truth, calibration.robot), 5.0 * sigma_mm);
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

  const auto refused = [&](const std::string& rows) {
    try {
      parse_measurements(rows, "m.csv", robot);
      return std::string("no error");
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(refused("q1_rad,x_mm,y_mm,z_mm,socket\n1,2,3,4,floor\n"),
            "m.csv:2: there are a measured point and a socket: leave the cells of one of them empty");
  EXPECT_EQ(refused("q1_rad,x_mm,y_mm,z_mm,socket\n1,2,3,4,\n2,,,,\n"),
            "m.csv:3: there is neither a measured point nor a socket");
  EXPECT_EQ(refused("q1_rad,x_mm,y_mm,socket\n1,2,3,\n2,,,a\n"),
            "m.csv:1: beside sockets, points need all of x, y and z");
}

}  // namespace
}  // namespace llmt::robotics
