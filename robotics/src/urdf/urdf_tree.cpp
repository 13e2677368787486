#include "urdf/urdf_tree.hpp"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <new>
#include <set>
#include <stdexcept>

#include "kinematics/checks.hpp"
#include "kinematics/units.hpp"
#include "llmt/limits.hpp"
#include "urdf/xml_check.hpp"

namespace llmt::robotics {
namespace {

// The messages that urdfdom would print.
class Listener final : public console_bridge::OutputHandler {
 public:
  Listener() : before_(console_bridge::getOutputHandler()) { console_bridge::useOutputHandler(this); }
  ~Listener() override { console_bridge::useOutputHandler(before_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR) return;
    if (said_.size() < 300) said_ += (said_.empty() ? "" : "; ") + text;
    complaints_.insert(text);
  }
  const std::string& said() const { return said_; }
  bool complained(const std::string& text) const { return complaints_.contains(text); }

 private:
  console_bridge::OutputHandler* before_;
  std::string said_;
  std::set<std::string> complaints_;
};

// What urdfdom says of a link whose mass it cannot read; it then takes 0.
std::string complaint_of_mass(const std::string& link) {
  return fmt::format("Could not parse inertial element for Link [{}]", link);
}

void check_masses(const urdf::ModelInterface& model, const Listener& listener, const std::string& name) {
  for (const auto& [link, body] : model.links_) {
    if (body->inertial && body->inertial->mass == 0.0 && listener.complained(complaint_of_mass(link))) {
      throw std::runtime_error(
          fmt::format("{}: link \"{}\": the mass cannot be read: {}", name, link, listener.said()));
    }
  }
}

// Every link but the root hangs on one joint, and all hang together. urdfdom takes the last parent of several, and does
// not look for loops.
void check_tree(const urdf::ModelInterface& model, const std::string& name) {
  std::map<std::string, std::string> joint_above;
  for (const auto& [joint, between] : model.joints_) {
    if (between->parent_link_name == between->child_link_name) {
      throw std::runtime_error(
          fmt::format("{}: joint \"{}\" makes link \"{}\" its own child", name, joint, between->child_link_name));
    }
    const auto [above, is_first] = joint_above.emplace(between->child_link_name, joint);
    if (!is_first) {
      throw std::runtime_error(fmt::format("{}: link \"{}\" has two parents: joints \"{}\" and \"{}\"", name,
                                           between->child_link_name, above->second, joint));
    }
  }
  std::set<std::string> reached;
  std::vector<const urdf::Link*> waiting = {model.getRoot().get()};
  while (!waiting.empty()) {
    const urdf::Link* const link = waiting.back();
    waiting.pop_back();
    reached.insert(link->name);
    for (const auto& child : link->child_links) waiting.push_back(child.get());
  }
  for (const auto& [link, body] : model.links_) {
    if (reached.contains(link)) continue;
    // It has one parent, as all have from here up: the way up meets a link again.
    std::vector<std::string> loop;
    std::set<std::string> met;
    for (std::string at = link; met.insert(at).second;) {
      loop.push_back(at);
      at = model.joints_.at(joint_above.at(at))->parent_link_name;
      if (met.contains(at)) loop.erase(loop.begin(), std::ranges::find(loop, at));
    }
    constexpr std::size_t shown = 10;
    const bool all = loop.size() <= shown;
    loop.resize(std::min(loop.size(), shown));
    throw std::runtime_error(
        fmt::format("{}: links \"{}\"{} form a loop", name, fmt::join(loop, "\", \""), all ? "" : " and more"));
  }
}

urdf::ModelInterfaceSharedPtr parsed(const std::string& text, const std::string& name) {
  check_xml(text, name);
  static std::mutex one_listener;
  const std::lock_guard lock(one_listener);
  const Listener listener;
  urdf::ModelInterfaceSharedPtr model;
  try {
    model = urdf::parseURDF(text);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw std::runtime_error(fmt::format("{}: no URDF: {}", name, error.what()));
  }
  if (!model) throw std::runtime_error(fmt::format("{}: no URDF: {}", name, listener.said()));
  try {
    check_tree(*model, name);
  } catch (...) {
    // Links of a loop own each other.
    for (const auto& [link, body] : model->links_) body->child_links.clear();
    throw;
  }
  check_masses(*model, listener, name);
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
  struct Place {
    const urdf::Link* link;
    int moving;  // joints from the base to here
  };
  std::map<std::string, int> ends;
  std::vector<Place> waiting = {{model.getLink(base).get(), 0}};
  while (!waiting.empty()) {
    const Place at = waiting.back();
    waiting.pop_back();
    if (at.link->child_joints.empty() && at.moving > 0) ends.emplace(at.link->name, at.moving);
    for (std::size_t k = 0; k < at.link->child_joints.size(); ++k) {
      waiting.push_back({at.link->child_links[k].get(), at.moving + (is_fixed(*at.link->child_joints[k]) ? 0 : 1)});
    }
  }
  std::vector<std::string> tips;
  std::vector<std::string> shown;
  for (const auto& [name, moving] : ends) {
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

// Masses from `first` on up to the joints of the arm, at zero.
void add_masses(const urdf::Link& first, const Eigen::Isometry3d& first_pose, const std::set<const urdf::Joint*>& arm,
                UrdfJoint& joint) {
  struct Place {
    const urdf::Link* link;
    Eigen::Isometry3d pose;
  };
  std::vector<Place> waiting = {{&first, first_pose}};
  while (!waiting.empty()) {
    const Place at = waiting.back();
    waiting.pop_back();
    if (const auto& inertial = at.link->inertial) {
      const Eigen::Vector3d centre = (at.pose * to_isometry(inertial->origin)).translation();
      joint.mass_kg += inertial->mass;
      joint.com_mm += inertial->mass * centre;
    }
    // The first child is taken first.
    for (std::size_t k = at.link->child_joints.size(); k-- > 0;) {
      const urdf::Joint& next = *at.link->child_joints[k];
      if (!is_fixed(next) && arm.contains(&next)) continue;
      waiting.push_back({at.link->child_links[k].get(), at.pose * to_isometry(next.parent_to_joint_origin_transform)});
    }
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
  // Programs that know no limits write 0 and 0, which is also what urdfdom takes where a file has none.
  const bool has_limits = from.limits && (from.limits->lower != 0.0 || from.limits->upper != 0.0);
  if (has_limits && from.type != urdf::Joint::CONTINUOUS) {
    if (!(from.limits->lower < from.limits->upper)) {
      refuse(fmt::format("has the lower limit {} and the upper limit {}: the lower one must be below the upper one",
                         from.limits->lower, from.limits->upper));
    }
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
  const auto moving = std::ranges::count_if(joints, [](const auto& joint) { return !is_fixed(*joint); });
  if (moving > most(Limit::robot_joints)) {
    throw std::runtime_error(
        fmt::format("{}: there are {} joints, at most {} are possible", name, moving, most(Limit::robot_joints)));
  }
  std::set<const urdf::Joint*> of_arm;
  for (const urdf::JointSharedPtr& joint : joints) of_arm.insert(joint.get());
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
    add_masses(*model->getLink(joint->child_link_name), next.child, of_arm, next);
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
