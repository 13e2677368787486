#include "hypotheses/catalogue_effects.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>

namespace llmt::robotics {
namespace {

std::string place_name(const Chain& chain, EffectPlace place, std::size_t index) {
  return place == EffectPlace::robot ? "" : chain.joints[index].name;
}

double mean_of(const Poses& poses, const std::string& column) { return poses.covariates.at(column).mean(); }

const Eigen::VectorXd* time_column(const Poses& poses) {
  for (const char* name : {"time_s", "order"}) {
    const auto found = poses.covariates.find(name);
    if (found != poses.covariates.end()) return &found->second;
  }
  return nullptr;
}

// The variants of a type at a place that are worth a hypothesis of their own.
std::vector<std::vector<double>> constants_for(const EffectType& type, const Scene& scene, std::size_t index) {
  if (type.constants.empty()) return {{}};
  if (type.name == "transmission_error") {
    const std::optional<double>& ratio = scene.robot.chain.joints[index].gear_ratio;
    if (!ratio) return {};
    return {{*ratio}, {2.0 * *ratio}, {4.0 * *ratio}};
  }
  if (type.family == "hysteresis") return {{0.005}, {0.015}, {0.04}, {0.1}, {0.3}};
  if (type.name == "thermal_growth" || type.name == "link_thermal_growth") return {{mean_of(scene.poses, "temp_C")}};
  if (type.family == "drift") {
    const Eigen::VectorXd& time = *time_column(scene.poses);
    const double from = time.minCoeff();
    const double to = time.maxCoeff();
    if (!(to > from)) return {};
    if (type.name != "drift_settling") return {{from, to}};
    // In steps so small that what a wrong one leaves is no knock of the instrument.
    std::vector<std::vector<double>> all;
    for (const double share : {0.03, 0.04, 0.06, 0.08, 0.11, 0.15, 0.2, 0.27, 0.37, 0.5, 0.7, 0.95}) {
      all.push_back({from, to, share});
    }
    return all;
  }
  if (type.name == "tracker_knock" || type.name == "joint_map") return {};
  if (type.name == "axis_wobble_at") {
    // The bearing is at one end of the offset along the axis or at the other; from round to round the same.
    constexpr double length_mm = 10.0;
    const double offset = length_mm * std::round(scene.robot.chain.joints[index].d_mm / length_mm);
    if (offset == 0.0) return {};
    return {{offset}};
  }
  if (type.name == "backlash_gravity_soft" || type.name == "joint_compliance_stiffening") {
    // The torque of an axis that stands upright is rounding.
    constexpr double rounding = 1e-9;
    const double largest = scene.largest_load(index);
    if (!(largest > rounding * scene.loads.cwiseAbs().maxCoeff())) return {};
    // Two digits are kept, so that the label is the same in every round.
    const auto rounded = [](double value) { return std::stod(fmt::format("{:.1e}", value)); };
    if (type.name == "joint_compliance_stiffening") return {{rounded(0.15 * largest)}, {rounded(0.4 * largest)}};
    return {{rounded(0.015 * largest)}, {rounded(0.035 * largest)}};
  }
  std::vector<double> usual;
  for (const EffectConstant& constant : type.constants) usual.push_back(constant.usual);
  return {usual};
}

bool masses_known(const Chain& chain, std::size_t index) {
  return std::ranges::all_of(std::span(chain.joints).subspan(index),
                             [](const Joint& joint) { return joint.mass_kg > 0.0; });
}

// Where masses are unknown but payloads are told, the known torque is that of the payload alone: beside a compliance
// with free masses it is the other part of one cause, so both may stand at one joint.
bool is_of_payload_alone(const EffectType& type, const Scene& scene, std::size_t index) {
  const std::span<const Joint> beyond = std::span(scene.robot.chain.joints).subspan(index);
  const auto payload = scene.poses.covariates.find("payload_kg");
  return type.name == "joint_compliance" && payload != scene.poses.covariates.end() &&
         payload->second.maxCoeff() > payload->second.minCoeff() &&
         std::ranges::all_of(beyond, [](const Joint& joint) { return joint.mass_kg == 0.0; });
}

// An instrument stands outside of what it sees: all points lie on one side of it, and not at its foot.
bool origin_may_be_an_instrument(const Scene& scene) {
  if (!std::ranges::all_of(scene.measured, [](bool seen) { return seen; })) return false;
  const Eigen::MatrixXd points = positions(scene.robot, scene.poses);
  const Eigen::Vector2d middle = points.leftCols(2).colwise().mean();
  constexpr double widest = 0.5;  // cosine of the angle from the middle
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Eigen::Vector2d point = points.row(i).head(2);
    if (!(point.dot(middle) > widest * point.norm() * middle.norm())) return false;
  }
  return true;
}

// An axis that is upright at all poses has no weight to balance.
bool is_upright(const Scene& scene, std::size_t joint) {
  constexpr double level = 1e-3;  // rad: less is the error of a stand
  const Chain& chain = scene.robot.chain;
  const Kinematics kinematics(chain);
  const Eigen::Vector3d gravity = chain.gravity_m_s2.normalized();
  for (Eigen::Index i = 0; i < scene.poses.count(); ++i) {
    const Skeleton arm = kinematics.skeleton(scene.poses.joints.row(i).transpose());
    const Eigen::Vector3d down = arm.base_rotation * gravity;
    if (arm.joint_axis[joint].cross(down).norm() > level) return false;
  }
  return true;
}

// No payload weighs less than nothing, as far as masses and softness are known.
void keep_payload_positive(const Poses& poses, const Chain& chain, discovery::EffectCandidate& candidate) {
  double least = std::numeric_limits<double>::infinity();
  const auto column = poses.covariates.find("payload_kg");
  if (column == poses.covariates.end()) {
    if (chain.payload.mass_kg > 0.0) least = chain.payload.mass_kg;
  } else {
    for (const double mass : column->second) {
      if (mass > 0.0) least = std::min(least, mass);
    }
  }
  constexpr double known = 0.1;  // two standard deviations of what masses are known to
  candidate.lower(0) = std::max(candidate.lower(0), -(1.0 + known) * least);
}

std::set<std::string> labels_of(const Robot& robot) {
  std::set<std::string> labels;
  for (const Effect& effect : robot.effects) labels.insert(effect_label(effect));
  return labels;
}

}  // namespace

std::vector<Hypothesis> catalogue_hypotheses(const Scene& scene, const std::vector<EffectType>& catalogue,
                                             std::vector<discovery::UntestableCause>& untestable) {
  const Chain& chain = scene.robot.chain;
  const std::set<std::string> present = labels_of(scene.robot);
  std::vector<Hypothesis> hypotheses;
  const bool is_measured = has_instrument(scene.poses);
  const bool is_polar = is_measured && origin_may_be_an_instrument(scene);
  for (const EffectType& type : catalogue) {
    if (!type.searched || (type.of_measuring && !is_measured)) continue;
    if (type.name.starts_with("instrument_") && !is_polar) {
      untestable.push_back({type.name, "the origin of the measurements is not where an instrument stands"});
      continue;
    }
    const std::size_t places = type.place == EffectPlace::robot ? 1 : chain.joints.size();
    for (std::size_t index = 0; index < places; ++index) {
      std::string why;
      const std::string place = place_name(chain, type.place, index);
      if (!suits(type, chain, index, &why)) continue;
      // This type has three unknowns per body and imitates many other effects: it is tried only where masses are
      // unknown.
      if (type.name == "joint_compliance_free_masses" && masses_known(chain, index)) continue;
      if (type.name == "counterbalance_spring" && is_upright(scene, index)) continue;
      if (!has_columns(type, chain, index, scene.poses, &why)) {
        untestable.push_back({place.empty() ? type.name : type.name + "@" + place,
                              "there is no column " + (why.starts_with("move") ? "order|time_s" : why)});
        continue;
      }
      // Where the approach is known, it belongs to the move: without it the width would be too small.
      if (type.name == "hysteresis" &&
          has_columns(effect_type("hysteresis_approach"), chain, index, scene.poses, &why)) {
        continue;
      }
      for (const std::vector<double>& constants : constants_for(type, scene, index)) {
        Effect effect = make_effect(type, chain, index, constants);
        if (present.contains(effect_label(effect))) continue;
        Hypothesis hypothesis;
        hypothesis.candidate.family = type.family;
        hypothesis.candidate.location = place;
        if (type.name == "transmission_error") hypothesis.candidate.location += fmt::format("[{}]", constants[0]);
        if (is_of_payload_alone(type, scene, index)) hypothesis.candidate.location += " payload";
        set_limits(type, std::ssize(effect.values), hypothesis.candidate);
        if (type.name == "payload_error") keep_payload_positive(scene.poses, chain, hypothesis.candidate);
        hypothesis.effect = std::move(effect);
        hypotheses.push_back(std::move(hypothesis));
      }
    }
  }
  return hypotheses;
}

void add_signatures(const Scene& scene, std::vector<Hypothesis>& hypotheses) {
  std::vector<Effect> effects;
  for (const Hypothesis& hypothesis : hypotheses) {
    if (hypothesis.effect) effects.push_back(*hypothesis.effect);
  }
  const Eigen::MatrixXd all = effect_signatures(scene.robot, effects, scene.poses);
  Eigen::Index next = 0;
  for (Hypothesis& hypothesis : hypotheses) {
    if (!hypothesis.effect) continue;
    const Eigen::Index k = std::ssize(hypothesis.effect->values);
    hypothesis.candidate.signature = all.middleCols(next, k);
    next += k;
  }
}

}  // namespace llmt::robotics
