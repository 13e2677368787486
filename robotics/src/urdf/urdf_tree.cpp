#include "urdf/urdf_tree.hpp"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tinyxml.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <mutex>
#include <stdexcept>

#include "kinematics/units.hpp"

namespace llmt::robotics {
namespace {

constexpr std::size_t deepest_nesting = 100;

// What urdfdom would print.
class Listener final : public console_bridge::OutputHandler {
 public:
  Listener() : before_(console_bridge::getOutputHandler()) { console_bridge::useOutputHandler(this); }
  ~Listener() override { console_bridge::useOutputHandler(before_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && said_.size() < 300)
      said_ += (said_.empty() ? "" : "; ") + text;
  }
  const std::string& said() const { return said_; }

 private:
  console_bridge::OutputHandler* before_;
  std::string said_;
};

void check_nesting(const std::string& text, const std::string& name) {
  std::size_t depth = 0;
  for (std::size_t at = text.find('<'); at != std::string::npos && at + 1 < text.size(); at = text.find('<', at + 1)) {
    const char next = text[at + 1];
    if (next == '?' || next == '!') continue;
    if (next == '/') {
      depth -= depth > 0 ? 1 : 0;
      continue;
    }
    const std::size_t end = text.find('>', at);
    const bool closed = end != std::string::npos && text[end - 1] == '/';
    if (!closed && ++depth > deepest_nesting) {
      throw std::runtime_error(fmt::format("{}: elements are nested deeper than {}", name, deepest_nesting));
    }
  }
}

urdf::ModelInterfaceSharedPtr parsed(const std::string& text, const std::string& name) {
  check_nesting(text, name);
  TiXmlDocument xml;
  xml.Parse(text.c_str());
  if (xml.Error()) {
    throw std::runtime_error(fmt::format("{}:{}:{}: {}", name, xml.ErrorRow(), xml.ErrorCol(), xml.ErrorDesc()));
  }
  static std::mutex one_listener;
  const std::lock_guard lock(one_listener);
  const Listener listener;
  urdf::ModelInterfaceSharedPtr model;
  try {
    model = urdf::parseURDF(text);
  } catch (const std::exception& error) {
    throw std::runtime_error(fmt::format("{}: no URDF: {}", name, error.what()));
  }
  if (!model) throw std::runtime_error(fmt::format("{}: no URDF: {}", name, listener.said()));
  return model;
}

Eigen::Isometry3d to_isometry(const urdf::Pose& pose) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  const Eigen::Quaterniond rotation(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z);
  result.linear() = rotation.normalized().toRotationMatrix();
  result.translation() = mm * Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z);
  return result;
}

bool is_fixed(const urdf::Joint& joint) { return joint.type == urdf::Joint::FIXED; }

std::vector<std::string> names_of_links(const urdf::ModelInterface& model) {
  std::vector<std::string> names;
  for (const auto& [name, link] : model.links_) names.push_back(name);
  return names;
}

urdf::LinkConstSharedPtr link_named(const urdf::ModelInterface& model, const std::string& name,
                                    const std::string& file) {
  const urdf::LinkConstSharedPtr link = model.getLink(name);
  if (link) return link;
  throw std::runtime_error(
      fmt::format("{}: there is no link \"{}\"; links: {}", file, name, fmt::join(names_of_links(model), ", ")));
}

// From the base to the tip; empty if the tip is not beyond the base.
std::vector<urdf::JointSharedPtr> joints_between(const urdf::ModelInterface& model, const std::string& base,
                                                 urdf::LinkConstSharedPtr tip) {
  std::vector<urdf::JointSharedPtr> joints;
  while (tip && tip->name != base && tip->parent_joint) {
    joints.push_back(tip->parent_joint);
    tip = model.getLink(tip->parent_joint->parent_link_name);
  }
  if (!tip || tip->name != base) joints.clear();
  std::ranges::reverse(joints);
  return joints;
}

std::string the_tip(const urdf::ModelInterface& model, const std::string& base, const std::string& file) {
  std::vector<std::string> tips;
  std::vector<std::string> shown;
  for (const auto& [name, link] : model.links_) {
    if (!link->child_joints.empty()) continue;
    const auto joints = joints_between(model, base, link);
    const auto moving = std::ranges::count_if(joints, [](const auto& joint) { return !is_fixed(*joint); });
    if (moving == 0) continue;
    tips.push_back(name);
    shown.push_back(fmt::format("{} ({} joints)", name, moving));
  }
  if (tips.size() == 1) return tips[0];
  if (tips.empty()) throw std::runtime_error(fmt::format("{}: no joint beyond link \"{}\" moves", file, base));
  throw std::runtime_error(
      fmt::format("{}: several chains begin at link \"{}\"; choose the tip link (--tip-link): {}; any "
                  "link between is possible, too",
                  file, base, fmt::join(shown, ", ")));
}

// Masses from `link` on up to the joints of the arm, at zero.
void add_masses(const urdf::Link& link, const Eigen::Isometry3d& pose, const std::vector<urdf::JointSharedPtr>& arm,
                UrdfJoint& joint) {
  if (link.inertial) {
    const Eigen::Vector3d centre = (pose * to_isometry(link.inertial->origin)).translation();
    joint.mass_kg += link.inertial->mass;
    joint.com_mm += link.inertial->mass * centre;
  }
  for (std::size_t k = 0; k < link.child_joints.size(); ++k) {
    const urdf::JointSharedPtr& next = link.child_joints[k];
    if (!is_fixed(*next) && std::ranges::find(arm, next) != arm.end()) continue;
    add_masses(*link.child_links[k], pose * to_isometry(next->parent_to_joint_origin_transform), arm, joint);
  }
}

UrdfJoint moving_joint(const urdf::Joint& from, const Eigen::Isometry3d& parent, const std::string& file) {
  const auto refuse = [&](const std::string& why) {
    throw std::runtime_error(fmt::format("{}: joint \"{}\" {}", file, from.name, why));
  };
  if (from.type != urdf::Joint::REVOLUTE && from.type != urdf::Joint::CONTINUOUS &&
      from.type != urdf::Joint::PRISMATIC) {
    refuse("is planar or floating: an arm has revolute, continuous, prismatic and fixed joints");
  }
  UrdfJoint joint;
  joint.name = from.name;
  joint.type = from.type == urdf::Joint::PRISMATIC ? JointType::prismatic : JointType::revolute;
  joint.parent = parent;
  joint.child = parent * to_isometry(from.parent_to_joint_origin_transform);
  const Eigen::Vector3d axis(from.axis.x, from.axis.y, from.axis.z);
  if (!(axis.norm() > 1e-6) || !axis.allFinite()) refuse("has an axis of length 0");
  joint.axis = joint.child.linear() * axis.normalized();
  if (from.limits && from.type != urdf::Joint::CONTINUOUS && from.limits->lower < from.limits->upper) {
    const double unit = joint.type == JointType::prismatic ? mm : 1.0 / radians;
    joint.limits = {unit * from.limits->lower, unit * from.limits->upper};
  }
  if (from.mimic) {
    const bool turns = joint.type == JointType::revolute;
    joint.mimic = Mimic{.joint = from.mimic->joint_name,
                        .multiplier = from.mimic->multiplier,
                        .offset = from.mimic->offset * (turns ? degrees : mm)};
  }
  return joint;
}

// A URDF counts in rad and m, a chain in rad and mm.
void set_units_of_mimics(UrdfArm& arm, const std::string& file) {
  for (UrdfJoint& joint : arm.joints) {
    if (!joint.mimic) continue;
    const auto leader = std::ranges::find(arm.joints, joint.mimic->joint, &UrdfJoint::name);
    if (leader == arm.joints.end()) {
      throw std::runtime_error(fmt::format(
          "{}: joint \"{}\" mimics \"{}\", which does not lie between base and tip; choose other links (--base-link, "
          "--tip-link)",
          file, joint.name, joint.mimic->joint));
    }
    if (joint.type == JointType::prismatic) joint.mimic->multiplier *= mm;
    if (leader->type == JointType::prismatic) joint.mimic->multiplier /= mm;
  }
}

}  // namespace

UrdfArm urdf_arm(const std::string& text, const std::string& name, const UrdfLinks& links) {
  const urdf::ModelInterfaceSharedPtr model = parsed(text, name);
  const std::string base = links.base.empty() ? model->getRoot()->name : links.base;
  link_named(*model, base, name);
  const std::string tip = links.tip.empty() ? the_tip(*model, base, name) : links.tip;
  const std::vector<urdf::JointSharedPtr> joints = joints_between(*model, base, link_named(*model, tip, name));
  UrdfArm arm{.name = model->getName(), .joints = {}, .tip = Eigen::Isometry3d::Identity(), .fixed_tip = {}};
  for (const urdf::JointSharedPtr& joint : joints) {
    if (is_fixed(*joint)) {
      arm.fixed_tip = UrdfTip{joint->name, arm.tip};
      arm.tip = arm.tip * to_isometry(joint->parent_to_joint_origin_transform);
      continue;
    }
    UrdfJoint& next = arm.joints.emplace_back(moving_joint(*joint, arm.tip, name));
    arm.tip = next.child;
    arm.fixed_tip.reset();
    add_masses(*model->getLink(joint->child_link_name), next.child, joints, next);
    if (next.mass_kg > 0.0) next.com_mm /= next.mass_kg;
  }
  if (!model->getLink(tip)->child_joints.empty()) arm.fixed_tip.reset();
  set_units_of_mimics(arm, name);
  if (arm.joints.empty()) {
    throw std::runtime_error(fmt::format("{}: no joint between the links \"{}\" and \"{}\" moves", name, base, tip));
  }
  return arm;
}

}  // namespace llmt::robotics
