#include "hypotheses/catalogue_effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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
  if (type.name == "hysteresis") return {{0.005}, {0.015}, {0.04}, {0.1}, {0.3}};
  if (type.name == "thermal_growth" || type.name == "link_thermal_growth") return {{mean_of(scene.poses, "temp_C")}};
  if (type.name == "drift" || type.name == "drift_curved") {
    const Eigen::VectorXd& time = *time_column(scene.poses);
    if (!(time.maxCoeff() > time.minCoeff())) return {};
    return {{time.minCoeff(), time.maxCoeff()}};
  }
  if (type.name == "tracker_knock" || type.name == "joint_map") return {};
  std::vector<double> usual;
  for (const EffectConstant& constant : type.constants) usual.push_back(constant.usual);
  return {usual};
}

bool masses_known(const Chain& chain, std::size_t index) {
  return std::ranges::any_of(std::span(chain.joints).subspan(index),
                             [](const Joint& joint) { return joint.mass_kg > 0.0; });
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
  for (const EffectType& type : catalogue) {
    if (!type.searched) continue;
    const std::size_t places = type.place == EffectPlace::robot ? 1 : chain.joints.size();
    for (std::size_t index = 0; index < places; ++index) {
      std::string why;
      const std::string place = place_name(chain, type.place, index);
      if (!suits(type, chain, index, &why)) continue;
      // This type has three unknowns per body and imitates many other effects: it is tried only where masses are
      // unknown.
      if (type.name == "joint_compliance_free_masses" && masses_known(chain, index)) continue;
      if (!has_columns(type, chain, index, scene.poses, &why)) {
        untestable.push_back({place.empty() ? type.name : type.name + "@" + place, "there is no column " + why});
        continue;
      }
      for (const std::vector<double>& constants : constants_for(type, scene, index)) {
        Effect effect = make_effect(type, chain, index, constants);
        if (present.contains(effect_label(effect))) continue;
        Hypothesis hypothesis;
        hypothesis.candidate.family = type.family;
        hypothesis.candidate.location = place;
        if (type.name == "transmission_error") hypothesis.candidate.location += fmt::format("[{}]", constants[0]);
        set_limits(type, std::ssize(effect.values), hypothesis.candidate);
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
