#include "hypotheses/catalogue_effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace llmt::robotics {
namespace {

std::string place_name(const Chain& chain, EffectPlace place, std::size_t index) {
  return place == EffectPlace::robot ? "" : chain.joints[index].name;
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
  const TrialContext context = scene.trial();
  const bool is_measured = has_instrument(scene.poses);
  const bool is_polar = is_measured && origin_may_be_an_instrument(scene);
  for (const EffectType& type : catalogue) {
    if (!type.searched || (type.of_measuring && !is_measured)) continue;
    if (type.nature == Nature::instrument && !is_polar) {
      untestable.push_back({type.name, "the origin of the measurements is not where an instrument stands"});
      continue;
    }
    const std::size_t places = type.place == EffectPlace::robot ? 1 : chain.joints.size();
    for (std::size_t index = 0; index < places; ++index) {
      std::string why;
      const std::string place = place_name(chain, type.place, index);
      if (!suits(type, chain, index)) continue;
      if (!has_columns(type, chain, index, scene.poses, &why)) {
        untestable.push_back({place.empty() ? type.name : type.name + "@" + place,
                              "there is no column " + (why.starts_with("move") ? "order|time_s" : why)});
        continue;
      }
      if (type.trial.is_worth_it && !type.trial.is_worth_it(context, index)) continue;
      for (const std::vector<double>& constants : constants_to_try(type, context, index)) {
        Effect effect = make_effect(type, chain, index, constants);
        if (present.contains(effect_label(effect))) continue;
        Hypothesis hypothesis;
        hypothesis.candidate.family = type.family;
        hypothesis.candidate.location = place;
        if (type.nature == Nature::wave) hypothesis.candidate.location += fmt::format("[{}]", constants[0]);
        const std::string part = type.trial.part ? type.trial.part(context, index) : "";
        if (!part.empty()) hypothesis.candidate.location += " " + part;
        set_limits(type, std::ssize(effect.values), hypothesis.candidate);
        if (type.trial.narrow) {
          Eigen::VectorXd& lower = hypothesis.candidate.lower;
          Eigen::VectorXd& upper = hypothesis.candidate.upper;
          type.trial.narrow(context, {lower.data(), lower.data() + lower.size()},
                            {upper.data(), upper.data() + upper.size()});
        }
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
