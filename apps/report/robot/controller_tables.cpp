#include "report/robot/controller_tables.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>

#include "llmt/robotics/kinematics.hpp"
#include "llmt/robotics/rigid_arm.hpp"
#include "report/robot/measurement_text.hpp"

namespace llmt::report {
namespace {

// Values below `smallest` are rounding errors and are written as 0.
double without_rounding(double value, double smallest) { return std::abs(value) < smallest ? 0.0 : value; }

// Of the joint's moving frame at zero.
Eigen::Isometry3d joint_frame(const robotics::Chain& chain, const robotics::Skeleton& zero, std::size_t joint) {
  constexpr double radians = 0.017453292519943295;
  const robotics::Joint& of = chain.joints[joint];
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() = zero.joint_frame[joint];
  frame.translation() = zero.joint_origin[joint];
  if (of.type == robotics::JointType::revolute) {
    frame.rotate(Eigen::AngleAxisd(radians * of.theta_deg, Eigen::Vector3d::UnitZ()));
  }
  if (of.sign < 0.0) frame.rotate(Eigen::AngleAxisd(3.141592653589793, Eigen::Vector3d::UnitX()));
  return frame;
}

struct ZeroFrames {
  std::vector<Eigen::Isometry3d> joints;
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();
};

// In the frame of the base.
ZeroFrames zero_frames(robotics::Chain chain) {
  chain.base = {};
  const robotics::Kinematics kinematics(chain);
  const robotics::Skeleton zero = kinematics.skeleton(Eigen::VectorXd::Zero(std::ssize(chain.joints)));
  ZeroFrames frames;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) frames.joints.push_back(joint_frame(chain, zero, j));
  frames.tool.linear() = zero.tool.rotation;
  frames.tool.translation() = zero.tool.position_mm;
  return frames;
}

// The frames of `chain` moved along and turned about their axes to those of `like`.
std::vector<Eigen::Isometry3d> moved_to(const robotics::Chain& like, const robotics::Chain& chain) {
  const auto require = [](bool holds, const std::string& what) {
    if (!holds) throw std::invalid_argument("--origins: the two descriptions are not of one arm: " + what);
  };
  require(like.joints.size() == chain.joints.size(), "their numbers of joints differ");
  const std::vector<Eigen::Isometry3d> there = zero_frames(like).joints;
  std::vector<Eigen::Isometry3d> frames = zero_frames(chain).joints;
  constexpr double farthest = 0.1;  // of the reach
  constexpr double most_turned_deg = 10.0;
  constexpr double degree = 0.017453292519943295;
  for (std::size_t j = 0; j < frames.size(); ++j) {
    const std::string& name = chain.joints[j].name;
    require(like.joints[j].type == chain.joints[j].type, name + " turns in one and slides in the other");
    const Eigen::Vector3d axis = frames[j].linear().col(2);
    const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(there[j].linear().col(2), axis);
    const double turned_deg = Eigen::AngleAxisd(turn).angle() / degree;
    require(turned_deg < most_turned_deg, fmt::format("their axes of {} differ by {:.3g} deg", name, turned_deg));
    Eigen::Vector3d to_origin = there[j].translation() - frames[j].translation();
    if (like.joints[j].type == robotics::JointType::revolute) to_origin = axis * axis.dot(to_origin);
    frames[j].translation() += to_origin;
    frames[j].linear() = turn.toRotationMatrix() * there[j].linear();
    const double off_mm = (frames[j].translation() - there[j].translation()).norm();
    require(off_mm < farthest * robotics::reach_of(like),
            fmt::format("the axis of {} passes {:.4g} mm from its origin in the other", name, off_mm));
  }
  return frames;
}

std::string origin_text(const std::string& name, const Eigen::Isometry3d& pose) {
  const Eigen::Vector3d rpy = robotics::roll_pitch_yaw(pose.linear());
  const Eigen::Vector3d xyz = 0.001 * pose.translation();
  const auto shown = [](double value) { return without_rounding(value, 1e-12); };  // m and rad
  return fmt::format("  {}: {{x: {}, y: {}, z: {}, roll: {}, pitch: {}, yaw: {}}}\n", name, shown(xyz(0)),
                     shown(xyz(1)), shown(xyz(2)), shown(rpy(0)), shown(rpy(1)), shown(rpy(2)));
}

// Frames and the zeros of the joints: what a controller takes that knows mastering offsets alone.
std::vector<std::string> zeros_of(const robotics::Chain& chain) {
  std::vector<std::string> names = {"base", "tool"};
  for (const robotics::Joint& joint : chain.joints) {
    if (joint.mimic) continue;
    names.push_back(joint.name + (joint.type == robotics::JointType::revolute ? ".theta" : ".d"));
  }
  return names;
}

// How far the tool is off by what the table does not hold.
std::string loss_of(const robotics::CorrectedRobot& whole, const robotics::Robot& alone, bool zeros) {
  const robotics::Measurements seen = robotics::points_of_model(whole);
  const double mean = robotics::distances(robotics::positions(alone, seen.poses), seen).mean();
  return fmt::format(
      "The table holds {} alone, fitted anew to the whole model over the calibrated joint ranges, because values "
      "identified beside {} belong together. Without the rest the tool is {:.4f} mm off on average; llmt-robot "
      "compensate has all",
      zeros ? "the zeros of the joints" : "the geometry", zeros ? "the others" : "effects and correction", mean);
}

}  // namespace

std::string kinematics_yaml(const robotics::Chain& described, const robotics::Chain* origins_of) {
  const ZeroFrames zero = zero_frames(described);
  const std::vector<Eigen::Isometry3d> frames = origins_of != nullptr ? moved_to(*origins_of, described) : zero.joints;
  std::string text =
      "# Pose of each joint in the frame of the one before, the first in the base, at zero; m and rad; fixed-axis "
      "roll,\n"
      "# pitch, yaw as in URDF. Every axis is z. tool: in the frame of the last joint.\n";
  for (const robotics::Joint& joint : described.joints) {
    if (!joint.mimic) continue;
    text += fmt::format("# {} has no drive: its value is {} times that of {}, plus {} {}.\n", joint.name,
                        joint.mimic->multiplier, joint.mimic->joint, joint.mimic->offset, robotics::limit_unit(joint));
  }
  text += "kinematics:\n";
  Eigen::Isometry3d before = Eigen::Isometry3d::Identity();
  for (std::size_t j = 0; j < frames.size(); ++j) {
    const robotics::Chain& named = origins_of != nullptr ? *origins_of : described;
    text += origin_text(named.joints[j].name, before.inverse() * frames[j]);
    before = frames[j];
  }
  return text + origin_text("tool", before.inverse() * zero.tool);
}

std::string deltas_csv(const robotics::Chain& chain, const robotics::Chain& nominal) {
  if (chain.convention != nominal.convention || chain.joints.size() != nominal.joints.size()) {
    throw std::invalid_argument("--deltas: the two descriptions differ in convention or number of joints");
  }
  std::string text = "joint,delta_theta_deg,delta_d_mm,delta_a_mm,delta_b_mm,delta_alpha_deg,delta_beta_deg\n";
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const robotics::Joint& now = chain.joints[j];
    const robotics::Joint& was = nominal.joints[j];
    const auto delta = [](double here, double there) { return without_rounding(here - there, 1e-9); };
    text += fmt::format("{},{},{},{},{},{},{}\n", now.name, delta(now.theta_deg, was.theta_deg),
                        delta(now.d_mm, was.d_mm), delta(now.a_mm, was.a_mm), delta(now.b_mm, was.b_mm),
                        delta(now.alpha_deg, was.alpha_deg), delta(now.beta_deg, was.beta_deg));
  }
  return text;
}

std::string geometry_table(const robotics::CorrectedRobot& robot, const GeometryChoice& choice, const Warn& warn) {
  const auto [nominal, zeros, origins_of] = choice;
  robotics::Robot alone = robotics::geometry_alone(robot);
  if (zeros && nominal != nullptr) alone.chain = robotics::fitted_to_model(*nominal, robot, zeros_of(*nominal));
  std::string text = nominal != nullptr ? deltas_csv(alone.chain, *nominal) : kinematics_yaml(alone.chain, origins_of);
  const bool has_more = !robot.robot.effects.empty() || robot.correction.has_value();
  if (has_more || zeros) warn(finding("rest_left_out", loss_of(robot, alone, zeros)));
  if (const std::string uncertain = uncertain_text(alone); !uncertain.empty()) {
    warn(finding("uncertain_values",
                 fmt::format("Uncertain values: {}. Calibration could not determine each of them alone, so do not take "
                             "them for the true ones. Load all values of the table into the controller, or none",
                             uncertain)));
  }
  return text;
}

}  // namespace llmt::report
