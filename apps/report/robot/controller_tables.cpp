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

std::string kinematics_yaml(const robotics::Chain& described) {
  robotics::Chain chain = described;
  chain.base = {};
  const robotics::Kinematics kinematics(chain);
  const robotics::Skeleton zero = kinematics.skeleton(Eigen::VectorXd::Zero(std::ssize(chain.joints)));
  std::string text =
      "# Pose of each joint in the frame of the one before, the first in the base, at zero; m and rad; fixed-axis "
      "roll,\n"
      "# pitch, yaw as in URDF. Every axis is z. tool: in the frame of the last joint.\n";
  for (const robotics::Joint& joint : chain.joints) {
    if (!joint.mimic) continue;
    text += fmt::format("# {} has no drive: its value is {} times that of {}, plus {} {}.\n", joint.name,
                        joint.mimic->multiplier, joint.mimic->joint, joint.mimic->offset, robotics::limit_unit(joint));
  }
  text += "kinematics:\n";
  Eigen::Isometry3d before = Eigen::Isometry3d::Identity();
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const Eigen::Isometry3d frame = joint_frame(chain, zero, j);
    text += origin_text(chain.joints[j].name, before.inverse() * frame);
    before = frame;
  }
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();
  tool.linear() = zero.tool.rotation;
  tool.translation() = zero.tool.position_mm;
  return text + origin_text("tool", before.inverse() * tool);
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

std::string geometry_table(const robotics::CorrectedRobot& robot, const robotics::Chain* nominal, bool zeros,
                           const Warn& warn) {
  robotics::Robot alone = robotics::geometry_alone(robot);
  if (zeros && nominal != nullptr) alone.chain = robotics::fitted_to_model(*nominal, robot, zeros_of(*nominal));
  std::string text = nominal != nullptr ? deltas_csv(alone.chain, *nominal) : kinematics_yaml(alone.chain);
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
