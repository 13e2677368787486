// The geometry of an arm whose axes are nearly parallel, for drivers that load poses of joints.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <regex>
#include <sstream>

#include "apps/programs.hpp"

namespace {

using program::Folder;
using program::Outcome;
using program::robot_program;

constexpr double degree = 0.017453292519943295;

struct Line {
  Eigen::Vector3d point;
  Eigen::Vector3d direction;
};

std::string joint_text(const std::string& name, double d, double theta, double a, double alpha) {
  return fmt::format("  - {{name: {}, type: revolute, d_mm: {}, theta_deg: {}, a_mm: {}, alpha_deg: {}}}\n", name, d,
                     theta, a, alpha);
}

const std::string head =
    "name: arm\nconvention: dh\nbase: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0]}\n"
    "tool: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0]}\njoints:\n";

// Shoulder, upper arm, forearm and three wrists, as arms with three parallel axes have them.
const std::string nominal = head + joint_text("shoulder", 89, 0, 0, 90) + joint_text("upper_arm", 0, 0, -425, 0) +
                            joint_text("forearm", 0, 0, -392, 0) + joint_text("wrist_1", 109, 0, 0, 90) +
                            joint_text("wrist_2", 95, 0, 0, -90) + joint_text("wrist_3", 82, 0, 0, 0);

// Axes of the nominal arm at zero, tilted by milliradians.
std::vector<Line> tilted_axes() {
  std::vector<Line> axes = {{{0, 0, 0}, {0, 0, 1}},         {{0, 0, 89}, {0, -1, 0}},
                            {{-425, 0, 89}, {0, -1, 0}},    {{-817, 0, 89}, {0, -1, 0}},
                            {{-817, -109, 89}, {0, 0, -1}}, {{-817, -109, -6}, {0, -1, 0}},
                            {{-817, -191, -6}, {0, -1, 0}}};
  const std::array<Eigen::Vector3d, 7> tilts = {{{0, 0, 0},
                                                 {0.0015, 0, 0.002},
                                                 {-0.002, 0, 0.004},
                                                 {0.001, 0, -0.003},
                                                 {0.001, 0.002, 0},
                                                 {0, 0, 0.001},
                                                 {0, 0, 0}}};
  for (std::size_t k = 0; k < axes.size(); ++k) axes[k].direction = (axes[k].direction + tilts[k]).normalized();
  axes.back().direction = axes[5].direction;
  axes.back().point = axes[5].point + 82.0 * axes[5].direction;
  return axes;
}

double angle_about(const Eigen::Vector3d& axis, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return std::atan2(axis.dot(from.cross(to)), from.dot(to)) / degree;
}

// Denavit and Hartenberg's parameters of the lines, from their common normals.
std::string exact_arm() {
  const std::vector<Line> axes = tilted_axes();
  std::string text = head;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  for (std::size_t k = 0; k + 1 < axes.size(); ++k) {
    const Line& own = axes[k];
    const Line& next = axes[k + 1];
    const Eigen::Vector3d normal = own.direction.cross(next.direction);
    const bool is_last = k + 2 == axes.size();
    const Eigen::Vector3d x_next = is_last ? x : Eigen::Vector3d(normal.normalized());
    const Eigen::Vector3d between = next.point - own.point;
    // The foot of the common normal on the own axis.
    const double along =
        is_last ? between.dot(own.direction) : between.cross(next.direction).dot(normal) / normal.squaredNorm();
    const Eigen::Vector3d foot = own.point + along * own.direction;
    const double a = is_last ? 0.0 : between.dot(x_next);
    text += joint_text(fmt::format("j{}", k + 1), (foot - origin).dot(own.direction),
                       angle_about(own.direction, x, x_next), a, angle_about(x_next, own.direction, next.direction));
    origin = foot + a * x_next;
    x = x_next;
  }
  return text;
}

std::vector<Eigen::Isometry3d> frames_in(const std::string& yaml, std::vector<std::string>& names) {
  const std::regex entry("  (\\w+): \\{x: (.*), y: (.*), z: (.*), roll: (.*), pitch: (.*), yaw: (.*)\\}");
  std::vector<Eigen::Isometry3d> frames;
  for (std::sregex_iterator at(yaml.begin(), yaml.end(), entry), end; at != end; ++at) {
    const auto number = [&](int k) { return std::stod((*at)[k]); };
    names.push_back((*at)[1]);
    frames.emplace_back(Eigen::Translation3d(1000 * number(2), 1000 * number(3), 1000 * number(4)) *
                        Eigen::AngleAxisd(number(7), Eigen::Vector3d::UnitZ()) *
                        Eigen::AngleAxisd(number(6), Eigen::Vector3d::UnitY()) *
                        Eigen::AngleAxisd(number(5), Eigen::Vector3d::UnitX()));
  }
  return frames;
}

TEST(ExportProgram, OriginsOfNearlyParallelAxesAreThoseOfTheNominalArm) {
  const Folder folder;
  folder.write("nominal.yaml", nominal);
  folder.write("exact.yaml", exact_arm());
  const Outcome far = folder.run(robot_program + " export exact.yaml --kinematics");
  const Outcome near = folder.run(robot_program + " export exact.yaml --kinematics --origins nominal.yaml");
  ASSERT_EQ(near.exit_code, 0) << near.err;
  std::vector<std::string> names;
  double farthest = 0.0;
  for (const Eigen::Isometry3d& frame : frames_in(far.out, names)) {
    farthest = std::max(farthest, frame.translation().norm());
  }
  EXPECT_GT(farthest, 1e4);  // ten metres and more
  names.clear();
  const std::vector<Eigen::Isometry3d> frames = frames_in(near.out, names);
  EXPECT_EQ(names,
            (std::vector<std::string>{"shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3", "tool"}));
  std::vector<std::string> nominal_names;
  const std::vector<Eigen::Isometry3d> meant =
      frames_in(folder.run(robot_program + " export nominal.yaml --kinematics").out, nominal_names);
  ASSERT_EQ(frames.size(), 7U);
  for (std::size_t k = 0; k < 7; ++k) {
    EXPECT_LT((frames[k].translation() - meant[k].translation()).norm(), 3.0) << names[k];
    if (k == 6) continue;  // the exact arm turns its tool as it will
    EXPECT_LT(Eigen::AngleAxisd(meant[k].linear().transpose() * frames[k].linear()).angle(), 0.02) << names[k];
  }
  // The poses of the joints, multiplied, are the arm.
  folder.write(
      "q.csv",
      "j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n10,-70,80,20,-50,30\n-100,-20,-60,140,60,-170\n0,0,0,0,0,0\n");
  const Outcome predicted = folder.run(robot_program + " predict exact.yaml q.csv -o p.csv");
  ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
  std::istringstream lines(llmt::read_file(folder.file("p.csv")));
  std::string line;
  std::getline(lines, line);
  const auto before_x = line.begin() + static_cast<std::ptrdiff_t>(line.find("x_mm"));
  const auto first = static_cast<std::size_t>(std::count(line.begin(), before_x, ','));
  const std::array<std::array<double, 6>, 3> joints = {
      {{10, -70, 80, 20, -50, 30}, {-100, -20, -60, 140, 60, -170}, {0, 0, 0, 0, 0, 0}}};
  for (const std::array<double, 6>& q : joints) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    for (std::size_t k = 0; k < 6; ++k) {
      pose = pose * frames[k] * Eigen::AngleAxisd(degree * q[k], Eigen::Vector3d::UnitZ());
    }
    pose = pose * frames[6];
    ASSERT_TRUE(std::getline(lines, line));
    std::vector<double> values;
    std::istringstream fields(line);
    for (std::string field; std::getline(fields, field, ',');) values.push_back(std::stod(field));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(pose.translation()(static_cast<Eigen::Index>(axis)), values.at(first + axis), 1e-6);
    }
  }
}

TEST(ExportProgram, OriginsOfAnotherArmAreRefused) {
  const Folder folder;
  folder.write("arm.yaml", nominal);
  folder.write("turned.yaml",
               std::regex_replace(nominal, std::regex("a_mm: -425, alpha_deg: 0"), "a_mm: -425, alpha_deg: 20"));
  folder.write("longer.yaml", std::regex_replace(nominal, std::regex("a_mm: -425"), "a_mm: -625"));
  folder.write("slide.yaml",
               std::regex_replace(nominal, std::regex("wrist_3, type: revolute"), "wrist_3, type: prismatic"));
  folder.write("short.yaml", nominal.substr(0, nominal.rfind("  - {name")));
  const auto refusal = [&](const std::string& other) {
    const Outcome run = folder.run(robot_program + " export arm.yaml --kinematics --origins " + other);
    EXPECT_NE(run.exit_code, 0);
    return run.err;
  };
  EXPECT_NE(refusal("turned.yaml").find("their axes of forearm differ by 20 deg"), std::string::npos);
  EXPECT_NE(refusal("longer.yaml").find("the axis of forearm passes 200 mm from"), std::string::npos);
  EXPECT_NE(refusal("slide.yaml").find("wrist_3 turns in one and slides in the other"), std::string::npos);
  EXPECT_NE(refusal("short.yaml").find("their numbers of joints differ"), std::string::npos);
  const Outcome alone = folder.run(robot_program + " export arm.yaml --deltas arm.yaml --origins arm.yaml");
  EXPECT_EQ(alone.exit_code, 2);
}

}  // namespace
