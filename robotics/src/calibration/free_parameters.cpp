#include "calibration/free_parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <stdexcept>

#include "kinematics/units.hpp"

namespace llmt::robotics {

std::string owner_of(const std::string& name) { return name.substr(0, name.rfind('.')); }

namespace {

// Reasons for which parameters stay as they are, in the words of descriptions.
constexpr const char* by_user = "fixed by the user";
constexpr const char* no_angles_of_socket = "a socket has no angles";
constexpr const char* no_angles_of_sphere = "a sphere has no angles";
constexpr const char* unseen_turn = "base and sockets take it up";

std::vector<bool> matches(const std::vector<discovery::Parameter>& parameters, const std::vector<std::string>& names,
                          const char* role) {
  std::vector<bool> matched(parameters.size(), false);
  for (const std::string& name : names) {
    bool found = false;
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      if (parameters[k].name != name && owner_of(parameters[k].name) != name) continue;
      matched[k] = true;
      found = true;
    }
    if (!found) {
      throw std::invalid_argument(
          fmt::format("llmt::robotics::calibrate: \"{}\", {}, is no parameter of the robot; parameters are e.g. "
                      "\"base.x\", \"{}\"",
                      name, role, parameters.back().name));
    }
  }
  return matched;
}

// The reason for which the convention leaves a parameter out before any data are seen; empty: there is none.
std::string excluded_by_convention(const Chain& chain, std::size_t joint, JointParameter which, double limit_deg) {
  if (which == JointParameter::b) return "not part of the convention";
  const bool parallel = is_nearly_parallel(chain, joint, limit_deg);
  if (which == JointParameter::beta && !parallel) return "only needed where axes are nearly parallel";
  if (which == JointParameter::d && parallel) return "axes are nearly parallel: beta takes its place";
  return "";
}

}  // namespace

void set_priors(std::vector<discovery::Parameter>& parameters, Eigen::Index geometric,
                const CalibrationOptions& options) {
  constexpr double frame_factor = 10.0;
  for (discovery::Parameter& parameter : std::span(parameters).first(geometric)) {
    const double factor = is_frame_parameter(parameter.name) ? frame_factor : 1.0;
    double sigma = 0.0;
    if (parameter.unit == "mm") sigma = factor * options.prior_length_mm;
    if (parameter.unit == "deg") sigma = factor * options.prior_angle_deg;
    if (!(sigma > 0.0)) continue;
    parameter.prior_sigma = sigma;
    parameter.prior_value = parameter.value;
  }
  for (const auto& [name, sigma] : options.priors) {
    if (!(sigma > 0.0) || !std::isfinite(sigma)) {
      throw std::invalid_argument(fmt::format(
          "llmt::robotics::calibrate: the standard deviation of the prior of {} is {}, must be above 0", name, sigma));
    }
    const std::vector<bool> named = matches(parameters, {name}, "which is given a prior");
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      if (!named[k]) continue;
      parameters[k].prior_sigma = sigma;
      parameters[k].prior_value = parameters[k].value;
    }
  }
}

bool is_nearly_parallel(const Chain& chain, std::size_t joint, double limit_deg) {
  // In both conventions alpha and beta turn one axis into the next; the first (mdh) or last (dh) pair involves base or
  // tool instead.
  if (chain.convention == Convention::dh ? joint + 1 == chain.joints.size() : joint == 0) return false;
  const Joint& j = chain.joints[joint];
  const double cosine = std::abs(std::cos(j.alpha_deg * radians) * std::cos(j.beta_deg * radians));
  return cosine >= std::cos(limit_deg * radians);
}

std::vector<std::string> reasons_to_fix(const Robot& robot, const CalibrationOptions& options) {
  const std::vector<discovery::Parameter> all = parameters(robot);
  std::vector<std::string> reasons(all.size());
  const std::vector<bool> fixed = matches(all, options.fixed, "which is to stay fixed");
  const std::vector<bool> only = matches(all, options.only, "which alone is to be fitted");
  if (options.only.empty()) {
    for (std::size_t j = 0; j < robot.chain.joints.size(); ++j) {
      for (const JointParameter which : {JointParameter::theta, JointParameter::d, JointParameter::a, JointParameter::b,
                                         JointParameter::alpha, JointParameter::beta}) {
        reasons[joint_parameter(j, which)] = excluded_by_convention(robot.chain, j, which, options.parallel_axes_deg);
      }
    }
  }
  for (std::size_t k = 0; k < all.size(); ++k) {
    const std::string owner = owner_of(all[k].name);
    const std::string base = owner.starts_with("base@") ? owner.substr(5) : "";
    const bool is_angle = all[k].unit == "deg";
    if (is_angle && is_socket(base)) reasons[k] = no_angles_of_socket;
    if (is_angle && (is_sphere(base) || is_known_sphere(base))) reasons[k] = no_angles_of_sphere;
    if (fixed[k] || (!options.only.empty() && !only[k])) reasons[k] = by_user;
  }
  return reasons;
}

void fix_what_sockets_take_up(const Robot& robot, const Poses& poses, std::vector<std::string>& reasons) {
  const auto in_socket = [](const Observation& seen) { return is_socket(seen.base); };
  if (std::ranges::none_of(poses.observations, in_socket)) return;
  const bool base_is_known = !reasons[base_parameter(FrameParameter::rx)].empty();
  if (has_instrument(poses) && base_is_known) return;
  std::vector<JointParameter> turns = {JointParameter::theta};
  if (robot.chain.convention == Convention::mdh) {
    turns.insert(turns.end(), {JointParameter::alpha, JointParameter::beta});
  }
  if (robot.chain.joints.front().type == JointType::prismatic) return;
  for (const JointParameter which : turns) {
    std::string& reason = reasons[joint_parameter(0, which)];
    if (reason.empty()) reason = unseen_turn;
  }
}

namespace {

bool has_known_sphere(const Poses& poses) {
  return std::ranges::any_of(poses.observations, is_known_sphere, &Observation::base);
}

// Between sockets.
bool has_length(const Poses& poses) {
  return std::ranges::any_of(poses.observations, [](const Observation& seen) {
    return seen.reading == Reading::distance && is_socket(seen.base);
  });
}

}  // namespace

void keep_scale(const Robot& robot, const Poses& poses, const CalibrationOptions& options,
                std::vector<std::string>& reasons) {
  const Chain& chain = robot.chain;
  if (has_instrument(poses) || has_known_sphere(poses) || has_length(poses)) return;
  const auto slides = [](const Joint& joint) { return joint.type == JointType::prismatic; };
  if (std::ranges::any_of(chain.joints, slides)) return;  // its travel is a length that is known
  const std::vector<discovery::Parameter> all = parameters(robot);
  constexpr double too_short_mm = 1.0;  // to give the scale
  Eigen::Index longest = -1;
  for (Eigen::Index k = 0; k < geometric_parameter_count(chain); ++k) {
    const discovery::Parameter& parameter = all[k];
    const bool is_of_base = parameter.name.starts_with("base");
    if (parameter.unit != "mm" || is_of_base || std::abs(parameter.value) < too_short_mm) continue;
    const bool has_prior = options.priors.contains(parameter.name) || options.priors.contains(owner_of(parameter.name));
    if (reasons[k] == by_user || has_prior) return;
    if (!reasons[k].empty() || is_frame_parameter(parameter.name)) continue;
    if (longest < 0 || std::abs(parameter.value) > std::abs(all[longest].value)) longest = k;
  }
  if (longest >= 0) reasons[longest] = unseen_scale;
}

std::set<std::string> unseen_by_touch(const Robot& robot) {
  const std::set<std::string> reasons = {unseen_scale, unseen_turn, no_angles_of_socket, no_angles_of_sphere};
  std::set<std::string> names;
  for (const IdentifiedParameter& entry : robot.identified) {
    if (reasons.contains(entry.state)) names.insert(entry.name);
  }
  return names;
}

std::vector<Eigen::Index> freed_parameters(const Robot& robot) {
  std::vector<Eigen::Index> freed;
  for (std::size_t k = 0; k < robot.identified.size(); ++k) {
    if (robot.identified[k].state.starts_with("free")) freed.push_back(static_cast<Eigen::Index>(k));
  }
  return freed;
}

void fix_dependent(const std::vector<discovery::Parameter>& parameters, const Eigen::MatrixXd& jacobian,
                   Eigen::Index geometric, double geometric_tolerance, std::vector<std::string>& reasons) {
  // On an arm that bends, directions that geometry imitates are a ten-thousandth off: fitted, they would be
  // millimetres long. The search takes the same share for imitated.
  constexpr double effect_tolerance = 1e-3;
  Eigen::MatrixXd basis(jacobian.rows(), jacobian.cols());
  Eigen::Index kept = 0;
  double largest = 0.0;
  // Frames first: what a frame can do as well is no error of the arm.
  std::vector<std::size_t> order(parameters.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_partition(order.begin(), order.end(),
                        [&](std::size_t k) { return is_frame_parameter(parameters[k].name); });
  for (const std::size_t k : order) {
    if (!reasons[k].empty()) continue;
    const bool is_geometric = static_cast<Eigen::Index>(k) < geometric;
    const double tolerance = is_geometric ? geometric_tolerance : std::max(effect_tolerance, geometric_tolerance);
    Eigen::VectorXd column = jacobian.col(k) * parameters[k].scale;
    const double size = column.norm();
    // Gram-Schmidt twice: once is not orthogonal enough where columns nearly depend on each other.
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::VectorXd shares = basis.leftCols(kept).transpose() * column;
      column -= basis.leftCols(kept) * shares;
    }
    largest = std::max(largest, size);
    if (size <= geometric_tolerance * largest) {
      reasons[k] = "does not move the measured point";
    } else if (column.norm() <= tolerance * size) {
      reasons[k] = "not distinguishable from parameters before it";
    } else {
      basis.col(kept++) = column.normalized();
    }
  }
}

}  // namespace llmt::robotics
