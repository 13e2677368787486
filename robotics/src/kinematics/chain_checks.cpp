#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "kinematics/checks.hpp"
#include "kinematics/mimics.hpp"
#include "llmt/limits.hpp"
#include "llmt/robotics/chain.hpp"

namespace llmt::robotics {
namespace {

[[noreturn]] void refuse(const std::string& field, const std::string& message) {
  throw FieldError(field, "llmt::robotics::Chain: " + message);
}

void validate_further(const char* field, const std::vector<NamedFrame>& frames, const std::string& own) {
  std::set<std::string> names;
  if (!own.empty()) names.insert(own);
  for (const NamedFrame& frame : frames) {
    if (frame.name.empty() || frame.name.find('.') != std::string::npos) {
      refuse(field, fmt::format("{}: name \"{}\" is empty or has a dot", field, frame.name));
    }
    if (!names.insert(frame.name).second) refuse(field, fmt::format("{}: name \"{}\" is taken", field, frame.name));
  }
}

void validate_joint(const Joint& joint) {
  if (joint.sign != 1.0 && joint.sign != -1.0)
    refuse("sign", fmt::format("{}: sign is {}, must be 1 or -1", joint.name, joint.sign));
  if (!(joint.mass_kg >= 0.0) || !std::isfinite(joint.mass_kg)) {
    refuse("mass_kg", fmt::format("{}: mass_kg is {}, must be >= 0", joint.name, joint.mass_kg));
  }
  if (!joint.com_mm.allFinite()) refuse("com_mm", fmt::format("{}: com_mm is not finite", joint.name));
  if (joint.limits && !((*joint.limits)[0] < (*joint.limits)[1])) {
    refuse(joint.type == JointType::revolute ? "limits_deg" : "limits_mm",
           fmt::format("{}: limits are [{}, {}], the first must be the smaller", joint.name, (*joint.limits)[0],
                       (*joint.limits)[1]));
  }
  if (joint.gear_ratio && !(std::isfinite(*joint.gear_ratio) && *joint.gear_ratio != 0.0)) {
    refuse("gear_ratio", fmt::format("{}: gear_ratio is {}, must be finite and not 0", joint.name, *joint.gear_ratio));
  }
}

void validate_mimic(const Chain& chain, const Joint& joint) {
  const Mimic& mimic = *joint.mimic;
  const auto leader = std::ranges::find(chain.joints, mimic.joint, &Joint::name);
  if (leader == chain.joints.end()) {
    refuse("mimic", fmt::format("{} mimics \"{}\", which is no joint of the chain", joint.name, mimic.joint));
  }
  if (leader->mimic) {
    refuse("mimic", fmt::format("{} mimics {}, which must have a drive of its own", joint.name, mimic.joint));
  }
  if (!(std::isfinite(mimic.multiplier) && mimic.multiplier != 0.0)) {
    refuse("mimic", fmt::format("{}: multiplier is {}, must be finite and not 0", joint.name, mimic.multiplier));
  }
  if (!std::isfinite(mimic.offset)) refuse("mimic", fmt::format("{}: the offset is not finite", joint.name));
}

void validate_ranges_of_mimics(const Chain& chain) {
  const std::vector<Follower> followers = followers_of(chain);
  if (followers.empty()) return;
  const auto count = std::ssize(chain.joints);
  Eigen::VectorXd low = Eigen::VectorXd::Constant(count, -std::numeric_limits<double>::infinity());
  Eigen::VectorXd high = -low;
  for (Eigen::Index j = 0; j < count; ++j) {
    const Joint& joint = chain.joints[j];
    if (!joint.limits) continue;
    low(j) = (*joint.limits)[0] / to_limit_unit(joint);
    high(j) = (*joint.limits)[1] / to_limit_unit(joint);
  }
  limit_leaders(followers, low, high);
  for (Eigen::Index j = 0; j < count; ++j) {
    if (low(j) <= high(j)) continue;
    refuse("mimic", fmt::format("the limits of {} and of the joints that mimic it have no value in common",
                                chain.joints[j].name));
  }
}

}  // namespace

void validate(const Chain& chain) {
  if (!chain.gravity_m_s2.allFinite()) refuse("gravity_m_s2", "gravity_m_s2 is not finite");
  if (!(chain.payload.mass_kg >= 0.0)) {
    refuse("payload", fmt::format("payload mass_kg is {}, must be >= 0", chain.payload.mass_kg));
  }
  if (chain.joints.empty()) refuse("joints", "there are no joints");
  if (std::ssize(chain.joints) > most(Limit::robot_joints)) {
    refuse("joints",
           fmt::format("there are {} joints, at most {} are possible", chain.joints.size(), most(Limit::robot_joints)));
  }
  std::set<std::string> names = {"base", "tool", "payload"};
  for (const Joint& joint : chain.joints) {
    if (joint.name.empty()) refuse("name", "a joint has no name");
    if (joint.name.find('.') != std::string::npos)
      refuse("name",
             fmt::format("joint name \"{}\" has a dot, which stands between a joint and its parameters (joint2.a): "
                         "write _ in its place, in the description and in the tables",
                         joint.name));
    if (!names.insert(joint.name).second) refuse("name", fmt::format("joint name \"{}\" is taken", joint.name));
    validate_joint(joint);
    if (joint.mimic) validate_mimic(chain, joint);
  }
  validate_ranges_of_mimics(chain);
  validate_further("bases", chain.bases, chain.session);
  validate_further("tools", chain.tools, chain.target);
  for (const discovery::Parameter& parameter : geometric_parameters(chain)) {
    if (!std::isfinite(parameter.value)) {
      throw std::invalid_argument(
          fmt::format("llmt::robotics::Chain: {} is {}, must be finite", parameter.name, parameter.value));
    }
  }
}

}  // namespace llmt::robotics
