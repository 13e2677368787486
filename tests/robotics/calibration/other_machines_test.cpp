// Machines that are no arms: slides, turntables, and the pose of a flange.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>

#include "llmt/files.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/likely_mistake.hpp"
#include "llmt/robotics/urdf.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

std::string joint(const char* name, const char* type, const char* parent, const char* child, const char* axis,
                  const char* limits) {
  return std::string("<joint name=\"") + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/><axis xyz=\"" + axis + "\"/><limit " + limits +
         " effort=\"1\" velocity=\"1\"/></joint>";
}

Robot robot_of(const std::string& text) {
  Robot robot;
  robot.chain = parse_urdf(text, "machine.urdf");
  return robot;
}

Robot gantry() {
  return robot_of("<robot name=\"gantry\"><link name=\"base\"/><link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>" +
                  joint("x", "prismatic", "base", "a", "1 0 0", "lower=\"0\" upper=\"2\"") +
                  joint("y", "prismatic", "a", "b", "0 1 0", "lower=\"0\" upper=\"1.5\"") +
                  joint("z", "prismatic", "b", "c", "0 0 1", "lower=\"-0.8\" upper=\"0\"") + "</robot>");
}

Robot turntable() {
  return robot_of("<robot name=\"t\"><link name=\"base\"/><link name=\"plate\"/>" +
                  joint("table", "revolute", "base", "plate", "0 0 1", "lower=\"-3\" upper=\"3\"") + "</robot>");
}

Poses poses_within_limits(const Chain& chain, Eigen::Index n, std::uint64_t seed) {
  Random random(seed);
  Poses poses;
  poses.joints.resize(n, std::ssize(chain.joints));
  for (Eigen::Index j = 0; j < poses.joints.cols(); ++j) {
    const Joint& own = chain.joints[j];
    const double unit = own.type == JointType::prismatic ? 1.0 : 0.017453292519943295;
    for (Eigen::Index i = 0; i < n; ++i) {
      poses.joints(i, j) = unit * random.uniform(own.limits->at(0), own.limits->at(1));
    }
  }
  return poses;
}

// Positions of slides are an affine function of their ways: least squares with nothing of our kinematics.
double affine_error(const Measurements& fitted, const Measurements& fresh) {
  const auto columns = [](const Measurements& table) {
    Eigen::MatrixXd all(table.count(), 4);
    all << Eigen::VectorXd::Ones(table.count()), table.poses.joints;
    return all;
  };
  const Eigen::MatrixXd fit = columns(fitted).colPivHouseholderQr().solve(fitted.positions_mm);
  return (columns(fresh) * fit - fresh.positions_mm).rowwise().norm().mean();
}

TEST(OtherMachines, AGantryIsAsGoodAsAnAffineFit) {
  constexpr double noise_mm = 0.01;
  const Robot nominal = gantry();
  Robot truth = nominal;
  truth.chain.joints[1].theta_deg += 0.011;
  truth.chain.joints[1].alpha_deg -= 0.009;
  truth.chain.joints[2].alpha_deg += 0.017;
  truth.chain.base = {{3000.0, -500.0, 50.0}, {-1.0, 2.0, 35.0}};
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Measurements seen = measure(truth, poses_within_limits(truth.chain, 40, seed), noise_mm, 10 + seed);
    const Measurements fresh = measure(truth, poses_within_limits(truth.chain, 60, 20 + seed), 0.0, 30 + seed);
    const CalibrationReport report = report_calibration(nominal, seen);
    EXPECT_FALSE(is_implausible(nominal, seen, report));
    EXPECT_TRUE(input_mistakes(nominal, seen, report).empty());
    EXPECT_FALSE(likely_mistake(nominal, seen));
    const double own = distances(positions(report.best(), fresh.poses), fresh).mean();
    // The three lengths of the axes are known to ours, which has fewer numbers.
    EXPECT_LT(own, 1.1 * affine_error(seen, fresh)) << seed;
    EXPECT_GT(report.nominal.held_out_mm.mean(), 3.0 * report.geometric.held_out_mm.mean());
  }
}

TEST(OtherMachines, SlidesInTheWrongUnitAreRefused) {
  const Robot nominal = gantry();
  Measurements seen = measure(nominal, poses_within_limits(nominal.chain, 40, 1), 0.01, 2);
  EXPECT_NEAR(size_of(nominal.chain, seen), 4300.0, 400.0);
  seen.poses.joints *= 1e-3;
  EXPECT_TRUE(is_implausible(nominal, seen, report_calibration(nominal, seen)));
}

TEST(OtherMachines, ATurntableHasTheSizeOfItsPoints) {
  Robot truth = turntable();
  truth.chain.tool.xyz_mm = {400.0, 30.0, 0.0};
  truth.chain.base = {{2000.0, 300.0, -45.0}, {0.1, 1.2, 0.0}};
  const Measurements seen = measure(truth, poses_within_limits(truth.chain, 24, 3), 0.015, 4);
  EXPECT_NEAR(size_of(turntable().chain, seen), 400.0, 40.0);
  const CalibrationReport report = report_calibration(turntable(), seen);
  EXPECT_FALSE(is_implausible(turntable(), seen, report));
  for (const Finding& mistake : input_mistakes(turntable(), seen, report)) EXPECT_NE(mistake.code, "calibrated_misses");
  EXPECT_LT(report.nominal.held_out_mm.mean(), 0.035);
  Measurements degrees = seen;
  degrees.poses.joints *= 0.017453292519943295;
  EXPECT_TRUE(is_implausible(turntable(), degrees, report_calibration(turntable(), degrees)));
}

// The way of an axis, joint after joint, all others at home.
Poses sweeps(const Chain& chain, Eigen::Index each) {
  Poses poses;
  const auto joints = std::ssize(chain.joints);
  poses.joints = Eigen::MatrixXd::Constant(joints * each, joints, 0.3);
  for (Eigen::Index j = 0; j < joints; ++j) {
    for (Eigen::Index k = 0; k < each; ++k) {
      poses.joints(j * each + k, j) = -1.2 + 2.4 * static_cast<double>(k) / static_cast<double>(each - 1);
    }
  }
  return poses;
}

TEST(Sweeps, AreFoundAndHeldOutWhole) {
  const Robot robot = ur_like();
  const std::vector<double> labels = sweeps_of(sweeps(robot.chain, 12));
  ASSERT_EQ(labels.size(), 72U);
  EXPECT_LE(labels.back(), 11.0);
  for (Eigen::Index j = 0; j < 6; ++j) {
    for (Eigen::Index k = 2; k < 12; ++k) EXPECT_EQ(labels[j * 12 + k], labels[j * 12 + 1]) << j << " " << k;
    if (j > 0) {
      EXPECT_NE(labels[j * 12 + 5], labels[j * 12 - 5]);
    }
  }
  EXPECT_TRUE(sweeps_of(random_poses(robot.chain, 60, 1)).empty());
  // Whole sweeps are left out: without the one of a joint nothing tells of its length.
  const Measurements seen = measure(perturbed(robot, 0.3, 0.05, 5), sweeps(robot.chain, 12), 0.02, 6);
  const CalibrationReport report = report_calibration(robot, seen);
  EXPECT_TRUE(report.grouped);
  EXPECT_GT(report.geometric.held_out_mm.mean(), 3.0 * report.geometric.in_sample_mm.mean());
}

// A X = Y B: the target on the flange and the robot in front of the camera, from flange poses alone.
TEST(OtherMachines, AFlangePoseGivesHandAndEye) {
  const std::string text = read_file(LLMT_SAMPLES_DIR "/flange.urdf");
  const Robot nominal = robot_of(text);
  Robot truth = nominal;
  truth.chain.tool = {{-25.0, 110.0, 40.0}, {-109.4, -58.5, 21.7}};
  truth.chain.base = {{1500.0, -300.0, 800.0}, {31.7, -29.5, -164.0}};
  for (Joint& own : truth.chain.joints) {
    own.limits = own.type == JointType::prismatic ? std::array{-600.0, 600.0} : std::array{-70.0, 70.0};
  }
  Measurements seen = measure(truth, poses_within_limits(truth.chain, 30, 7), 0.1, 8);
  seen.orientation.kind = Orientation::Kind::quaternion;
  seen.orientation.values.resize(30, 4);
  const std::vector<Pose> tools = tool_poses(truth, seen.poses);
  for (Eigen::Index i = 0; i < 30; ++i) {
    const Eigen::Quaterniond q(tools[i].rotation);
    seen.orientation.values.row(i) << q.w(), q.x(), q.y(), q.z();
  }
  seen = with_orientations(seen, truth.chain);
  CalibrationOptions options;
  options.only = {"base", "tool"};
  const Calibration found = calibrate(nominal, seen, options);
  EXPECT_LT((found.robot.chain.tool.xyz_mm - truth.chain.tool.xyz_mm).norm(), 0.15);
  EXPECT_LT((found.robot.chain.base.xyz_mm - truth.chain.base.xyz_mm).norm(), 0.15);
  for (const IdentifiedParameter& entry : found.robot.identified) {
    if (!entry.standard_error) continue;
    EXPECT_LT(*entry.standard_error, entry.name.find(".r") == std::string::npos ? 0.1 : 0.05);
  }
  // The written URDF has the hand as the origin of its last joint.
  EXPECT_TRUE(to_urdf(text, "flange.urdf", {}, found.robot.chain).has_tool);
}

}  // namespace
}  // namespace llmt::robotics
