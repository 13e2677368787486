#include "llmt/robotics/chain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "kinematics/units.hpp"

namespace llmt::robotics {
namespace {

constexpr double length_scale_mm = 1.0;
constexpr double angle_scale_deg = 0.1;  // moves a point one metre away by about 2 mm
constexpr Eigen::Index frame_parameters = 6;
constexpr Eigen::Index joint_parameters = 6;

// Every geometric value of a chain in the fixed order; one place decides the order for reading and writing.
template <typename ChainType, typename Visit>
void visit_values(ChainType& chain, Visit visit) {
  const auto visit_frame = [&](auto& frame) {
    for (int i = 0; i < 3; ++i) visit(frame.xyz_mm(i));
    for (int i = 0; i < 3; ++i) visit(frame.rpy_deg(i));
  };
  visit_frame(chain.base);
  visit_frame(chain.tool);
  for (auto& joint : chain.joints) {
    visit(joint.theta_deg);
    visit(joint.d_mm);
    visit(joint.a_mm);
    visit(joint.b_mm);
    visit(joint.alpha_deg);
    visit(joint.beta_deg);
  }
  for (auto* frames : {&chain.bases, &chain.tools}) {
    for (auto& further : *frames) visit_frame(further.frame);
  }
  for (auto& base : chain.bases) {
    if (is_sphere(base.name)) visit(base.radius_mm);
  }
}

}  // namespace

std::vector<discovery::Parameter> geometric_parameters(const Chain& chain) {
  std::vector<discovery::Parameter> parameters;
  const auto add = [&](const std::string& owner, const char* field, bool is_angle) {
    parameters.push_back({.name = owner + "." + field,
                          .unit = is_angle ? "deg" : "mm",
                          .scale = is_angle ? angle_scale_deg : length_scale_mm});
  };
  const auto add_frame = [&](const std::string& owner) {
    for (const char* field : {"x", "y", "z"}) add(owner, field, false);
    for (const char* field : {"rx", "ry", "rz"}) add(owner, field, true);
  };
  add_frame("base");
  add_frame("tool");
  for (const Joint& joint : chain.joints) {
    add(joint.name, "theta", true);
    add(joint.name, "d", false);
    add(joint.name, "a", false);
    add(joint.name, "b", false);
    add(joint.name, "alpha", true);
    add(joint.name, "beta", true);
  }
  for (const NamedFrame& base : chain.bases) add_frame("base@" + base.name);
  for (const NamedFrame& tool : chain.tools) add_frame("tool@" + tool.name);
  for (const NamedFrame& base : chain.bases) {
    if (is_sphere(base.name)) add("base@" + base.name, "radius", false);
  }
  std::size_t next = 0;
  visit_values(chain, [&](const double& value) { parameters[next++].value = value; });
  return parameters;
}

double reach_of(const Chain& chain) {
  double reach = chain.tool.xyz_mm.norm();
  for (const Joint& joint : chain.joints) reach += std::abs(joint.a_mm) + std::abs(joint.d_mm);
  return reach;
}

Eigen::Index geometric_parameter_count(const Chain& chain) {
  return frame_parameters * (2 + std::ssize(chain.bases) + std::ssize(chain.tools)) +
         joint_parameters * std::ssize(chain.joints) + std::ranges::count_if(chain.bases, is_sphere, &NamedFrame::name);
}

Eigen::VectorXd geometric_values(const Chain& chain) {
  Eigen::VectorXd values(geometric_parameter_count(chain));
  Eigen::Index next = 0;
  visit_values(chain, [&](const double& value) { values(next++) = value; });
  return values;
}

Chain with_geometric_values(Chain chain, const Eigen::VectorXd& values) {
  if (values.size() != geometric_parameter_count(chain)) {
    throw std::invalid_argument(fmt::format("llmt::robotics::with_geometric_values: values has {} entries, must be {}",
                                            values.size(), geometric_parameter_count(chain)));
  }
  Eigen::Index next = 0;
  visit_values(chain, [&](double& value) { value = values(next++); });
  return chain;
}

bool is_frame_parameter(std::string_view name) {
  const std::string_view owner = name.substr(0, std::min(name.find('.'), name.find('@')));
  return owner == "base" || owner == "tool";
}

bool is_socket(std::string_view base) { return base.starts_with("socket "); }

bool is_plane(std::string_view base) { return base.starts_with("plane "); }

bool is_sphere(std::string_view base) { return base.starts_with("sphere "); }

bool is_known_sphere(std::string_view base) { return base.starts_with("known sphere "); }

bool is_touched(std::string_view base) {
  return is_socket(base) || is_plane(base) || is_sphere(base) || is_known_sphere(base);
}

double to_limit_unit(const Joint& joint) { return joint.type == JointType::revolute ? degrees : 1.0; }

std::string limit_unit(const Joint& joint) { return joint.type == JointType::revolute ? "deg" : "mm"; }

std::size_t joint_index(const Chain& chain, std::string_view name) {
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    if (chain.joints[i].name == name) return i;
  }
  throw std::invalid_argument(fmt::format("llmt::robotics::joint_index: there is no joint \"{}\"", name));
}

Eigen::Index base_parameter(FrameParameter which) { return static_cast<Eigen::Index>(which); }

Eigen::Index tool_parameter(FrameParameter which) { return frame_parameters + static_cast<Eigen::Index>(which); }

Eigen::Index joint_parameter(std::size_t joint, JointParameter which) {
  return 2 * frame_parameters + joint_parameters * static_cast<Eigen::Index>(joint) + static_cast<Eigen::Index>(which);
}

}  // namespace llmt::robotics
