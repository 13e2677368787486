#include "llmt/robotics/urdf.hpp"

#include <fmt/format.h>
#include <tinyxml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "kinematics/units.hpp"
#include "llmt/files.hpp"
#include "llmt/robotics/kinematics.hpp"
#include "urdf/urdf_tree.hpp"

namespace llmt::robotics {
namespace {

double without_rounding(double value) { return std::abs(value) < 1e-10 ? 0.0 : value; }

Eigen::Isometry3d to_pose(const Frame& frame) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(frame.xyz_mm);
  for (const Eigen::Index axis : {2, 1, 0}) {
    pose.rotate(Eigen::AngleAxisd(radians * frame.rpy_deg(axis), Eigen::Vector3d::Unit(axis)));
  }
  return pose;
}

Frame to_frame(const Eigen::Isometry3d& pose) {
  Frame frame;
  frame.xyz_mm = pose.translation().unaryExpr(&without_rounding);
  frame.rpy_deg = (roll_pitch_yaw(pose.linear()) / radians).unaryExpr(&without_rounding);
  return frame;
}

// M = Rx(alpha) Tx(a) Ty(b) Ry(beta) Rz(theta) Tz(d)
void set_parameters(Joint& joint, const Eigen::Isometry3d& m) {
  const Eigen::Matrix3d r = m.linear();
  const double alpha = std::atan2(-r(1, 2), r(2, 2));
  const double beta = std::atan2(r(0, 2), std::hypot(r(0, 0), r(0, 1)));
  const double theta = std::atan2(-r(0, 1), r(0, 0));
  const Eigen::Vector3d t = Eigen::AngleAxisd(-alpha, Eigen::Vector3d::UnitX()) * m.translation();
  const double d = t.z() / std::cos(beta);
  joint.alpha_deg = without_rounding(alpha / radians);
  joint.beta_deg = without_rounding(beta / radians);
  joint.theta_deg = without_rounding(theta / radians);
  joint.d_mm = without_rounding(d);
  joint.a_mm = without_rounding(t.x() - d * std::sin(beta));
  joint.b_mm = without_rounding(t.y());
}

Eigen::Isometry3d transform_of(const Joint& joint) {
  Eigen::Isometry3d m = Eigen::Isometry3d::Identity();
  m.rotate(Eigen::AngleAxisd(radians * joint.alpha_deg, Eigen::Vector3d::UnitX()));
  m.translate(Eigen::Vector3d(joint.a_mm, joint.b_mm, 0.0));
  m.rotate(Eigen::AngleAxisd(radians * joint.beta_deg, Eigen::Vector3d::UnitY()));
  m.rotate(Eigen::AngleAxisd(radians * joint.theta_deg, Eigen::Vector3d::UnitZ()));
  m.translate(Eigen::Vector3d(0.0, 0.0, joint.d_mm));
  return m;
}

// Holds the nominal chain against the identified one.
void check_same_arm(const UrdfArm& arm, const Chain& chain) {
  bool same = chain.convention == Convention::mdh && chain.joints.size() == arm.joints.size();
  for (std::size_t j = 0; same && j < arm.joints.size(); ++j) {
    same = chain.joints[j].name == arm.joints[j].name && chain.joints[j].type == arm.joints[j].type &&
           chain.joints[j].sign == 1.0;
  }
  if (!same) throw std::invalid_argument("llmt::robotics::to_urdf: the chain is not that of the URDF");
}

std::string numbers(const Eigen::Vector3d& values) { return fmt::format("{} {} {}", values(0), values(1), values(2)); }

void set_origin(TiXmlElement& robot, const std::string& joint, const Eigen::Isometry3d& pose) {
  for (TiXmlElement* element = robot.FirstChildElement("joint"); element != nullptr;
       element = element->NextSiblingElement("joint")) {
    const char* name = element->Attribute("name");
    if (name == nullptr || joint != name) continue;
    TiXmlElement* origin = element->FirstChildElement("origin");
    if (origin == nullptr) origin = element->InsertEndChild(TiXmlElement("origin"))->ToElement();
    origin->SetAttribute("xyz", numbers(pose.translation() / mm));
    origin->SetAttribute("rpy", numbers(roll_pitch_yaw(pose.linear())));
  }
}

}  // namespace

bool is_urdf(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending == ".urdf") return true;
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) return false;  // a pipe would lose what is read of it
  char first = '\0';
  std::ifstream(path) >> first;
  return first == '<';
}

Chain parse_urdf(const std::string& text, const std::string& name, const UrdfLinks& links) {
  const UrdfArm arm = urdf_arm(text, name, links);
  const std::vector<Eigen::Isometry3d> frames = frames_of(arm);
  Chain chain;
  chain.name = arm.name;
  chain.convention = Convention::mdh;
  chain.base = to_frame(frames.front());
  chain.gravity_m_s2 = frames.front().linear().transpose() * chain.gravity_m_s2;
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    const UrdfJoint& from = arm.joints[j];
    Joint& joint = chain.joints.emplace_back();
    joint.name = from.name;
    joint.type = from.type;
    set_parameters(joint, frames[j].inverse() * frames[j + 1]);
    joint.limits = from.limits;
    joint.mimic = from.mimic;
    joint.mass_kg = from.mass_kg;
    if (from.mass_kg > 0.0) joint.com_mm = frames[j + 1].inverse() * from.com_mm;
  }
  chain.tool = to_frame(frames.back().inverse() * arm.tip);
  try {
    validate(chain);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", name, error.what()));
  }
  return chain;
}

Chain read_urdf(const std::string& path, const UrdfLinks& links) {
  return parse_urdf(read_file(path, description_limit), path, links);
}

IdentifiedUrdf to_urdf(const std::string& text, const std::string& name, const UrdfLinks& links,
                       const Chain& identified) {
  const UrdfArm arm = urdf_arm(text, name, links);
  check_same_arm(arm, identified);
  const std::vector<Eigen::Isometry3d> nominal = frames_of(arm);
  TiXmlDocument xml;
  xml.Parse(text.c_str());
  TiXmlElement* robot = xml.RootElement();
  Eigen::Isometry3d frame = nominal.front();
  Eigen::Isometry3d link_before = Eigen::Isometry3d::Identity();  // of the identified arm
  Eigen::Isometry3d nominal_before = Eigen::Isometry3d::Identity();
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    const UrdfJoint& joint = arm.joints[j];
    frame = frame * transform_of(identified.joints[j]);
    // Links keep their places relative to the frames on the axes, and what is fixed to them keeps its own.
    const Eigen::Isometry3d link = frame * (nominal[j + 1].inverse() * joint.child);
    const Eigen::Isometry3d parent = link_before * (nominal_before.inverse() * joint.parent);
    set_origin(*robot, joint.name, parent.inverse() * link);
    link_before = link;
    nominal_before = joint.child;
  }
  if (arm.fixed_tip) {
    const Eigen::Isometry3d parent = link_before * (nominal_before.inverse() * arm.fixed_tip->parent);
    set_origin(*robot, arm.fixed_tip->joint, parent.inverse() * (frame * to_pose(identified.tool)));
  }
  TiXmlPrinter printer;
  printer.SetIndent("  ");
  xml.Accept(&printer);
  return {printer.Str(), arm.fixed_tip.has_value()};
}

}  // namespace llmt::robotics
