#include "discovery/judges/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/still_joints.hpp"

namespace llmt::robotics {
namespace {

std::string label_of(const Hypothesis& hypothesis) {
  return hypothesis.effect ? effect_label(*hypothesis.effect)
                           : hypothesis.candidate.family + "@" + hypothesis.candidate.location;
}

std::vector<FoundParameter> parameters_of(const Effect& effect, const Calibration& fitted, double mass_uncertainty) {
  const std::vector<discovery::Parameter> all = parameters(fitted.robot);
  std::vector<FoundParameter> found;
  for (const EffectParameter& parameter : effect_parameters(fitted.robot.chain, effect)) {
    const std::string name = effect_parameter_name(effect, parameter);
    const auto index = std::ranges::find(all, name, &discovery::Parameter::name) - all.begin();
    const double value = all[index].value;
    // A parameter that does not move the tool was held by the calibration: its error is 0 and its value not determined.
    const double error = fitted.result.standard_errors(index);
    const double known = effect_type(effect.type).scales_with_mass ? mass_uncertainty * value : 0.0;
    found.push_back({parameter.name, value, parameter.unit,
                     error > 0.0 ? std::hypot(error, known) : std::numeric_limits<double>::quiet_NaN()});
  }
  return found;
}

void add_rivals(const discovery::Finding& finding, const std::vector<Hypothesis>& hypotheses, FoundEffect& found) {
  for (const discovery::Rival& rival : finding.rivals) {
    std::string labels;
    std::vector<Effect> effects;
    for (const std::size_t a : rival.candidates) {
      labels += (labels.empty() ? "" : " + ") + label_of(hypotheses[a]);
      if (hypotheses[a].effect) effects.push_back(*hypotheses[a].effect);
    }
    found.rivals.push_back(labels);
    found.rival_effects.push_back(std::move(effects));
    found.exact_alias = found.exact_alias || rival.exact;
  }
}

}  // namespace

std::vector<FoundPattern> found_patterns(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict) {
  std::vector<FoundPattern> patterns;
  for (const discovery::Finding& finding : verdict.findings) {
    for (const discovery::FindingTerm& term : finding.terms) {
      if (finding.generic) patterns.push_back({hypotheses[term.candidate].pattern, term.share});
    }
  }
  std::ranges::stable_sort(patterns, std::greater<>{}, &FoundPattern::share);
  return patterns;
}

std::vector<FoundPattern> patterns_left(const Findings& found) {
  if (!found.residual_search) return {};
  return found_patterns(found.residual_search->asked.hypotheses, found.residual_search->verdict);
}

std::vector<Name> named_effects(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict,
                                const Calibration& fitted, double mass_uncertainty) {
  const double explained = verdict.sum_of_squares - verdict.left;
  const auto samples = static_cast<double>(std::max<Eigen::Index>(1, fitted.result.residuals.size() / 3));
  std::vector<Name> names;
  for (const discovery::Finding& finding : verdict.findings) {
    for (const discovery::FindingTerm& term : finding.terms) {
      const Hypothesis& hypothesis = hypotheses[term.candidate];
      if (finding.generic || !hypothesis.effect) continue;
      const std::string label = effect_label(*hypothesis.effect);
      const auto fitted_effect = std::ranges::find(fitted.robot.effects, label, effect_label);
      if (fitted_effect == fitted.robot.effects.end()) continue;
      FoundEffect found;
      found.effect = *fitted_effect;
      found.title = effect_type(found.effect.type).title;
      found.parameters = parameters_of(found.effect, fitted, mass_uncertainty);
      found.share = finding.terms.size() == 1 ? finding.share : term.share;
      const auto rms = [&](double share) { return std::sqrt(std::max(0.0, share * explained) / samples); };
      found.rms_mm = rms(found.share);
      found.family_rms_mm = rms(finding.share);
      add_rivals(finding, hypotheses, found);
      names.push_back({std::move(found), finding.share});
    }
  }
  return names;
}

std::vector<Name> smaller_effects(const ResidualSearch& search, const discovery::Verdict& verdict,
                                  const Calibration& fitted, double mass_uncertainty) {
  if (search.verdict.answer == discovery::Answer::unknown) return {};
  std::vector<Name> names = named_effects(search.asked.hypotheses, search.verdict, fitted, mass_uncertainty);
  const double explained = verdict.sum_of_squares - verdict.left;
  const double part = explained > 0.0 ? (search.verdict.sum_of_squares - search.verdict.left) / explained : 1.0;
  for (Name& name : names) {
    name.effect.smaller = true;
    name.effect.share *= part;
    name.family_share *= part;
  }
  return names;
}

std::vector<BeyondPlausible> beyond_plausible(const Investigation& investigation, const Robot& robot) {
  std::vector<BeyondPlausible> all;
  const auto add = [&](Effect effect, const discovery::EffectCandidate& limits) {
    const EffectType& type = effect_type(effect.type);
    const auto same_family = [&](const auto& one) { return effect_type(one.effect.type).family == type.family; };
    if (limits.lower.size() == 0 || std::ranges::any_of(all, same_family)) return;
    const std::vector<EffectParameter> own = effect_parameters(robot.chain, effect);
    BeyondPlausible beyond;
    double farthest = 0.0;
    for (std::size_t k = 0; k < own.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      const double value = effect.values[k];
      const double width = limits.upper(i) - limits.lower(i);
      const double off = std::max(limits.lower(i) - value, value - limits.upper(i)) / width;
      if (!(off > farthest)) continue;
      farthest = off;
      beyond.parameter = {own[k].name, value, own[k].unit, 0.0};
      beyond.limit = value > limits.upper(i) ? limits.upper(i) : limits.lower(i);
    }
    // A limit of 0 is one of the sign: a negative stiffness is not a size. A value ten plausible ranges away is no size
    // either: other effects cancel it, and it explains nothing alone.
    constexpr double most_ranges = 10.0;
    if (farthest == 0.0 || farthest > most_ranges || beyond.limit == 0.0) return;
    beyond.title = type.title;
    beyond.effect = std::move(effect);
    all.push_back(std::move(beyond));
  };
  for (const discovery::Refused& one : investigation.verdict.refused) {
    const Hypothesis& hypothesis = investigation.asked.hypotheses[one.candidate];
    if (!hypothesis.effect) continue;
    Effect effect = *hypothesis.effect;
    effect.values.assign(one.values.begin(), one.values.end());
    add(std::move(effect), hypothesis.candidate);
  }
  for (const auto& [label, effect] : investigation.implausible) {
    discovery::EffectCandidate limits;
    set_limits(effect_type(effect.type), std::ssize(effect.values), limits);
    add(effect, limits);
  }
  return all;
}

Limits limits_of(const Investigation& investigation, const Robot& robot) {
  const std::vector<Hypothesis>& hypotheses = investigation.asked.hypotheses;
  Limits limits{investigation.asked.untestable, {}};
  const std::vector<StillJoint> still = still_joints(robot.chain, investigation.searched.poses);
  for (std::size_t a = 0; a < hypotheses.size(); ++a) {
    if (!hypotheses[a].effect) continue;
    const discovery::Sensitivity& own = investigation.verdict.sensitivity[a];
    if (own.absorbed) {
      const bool is_still = std::ranges::find(still, hypotheses[a].effect->at, &StillJoint::joint) != still.end();
      limits.not_testable.push_back(
          {label_of(hypotheses[a]), is_still
                                        ? "its joint hardly moves, and geometry imitates it there"
                                        : "geometry, or what is in the model already, imitates it at these poses"});
      continue;
    }
    limits.visible.push_back({label_of(hypotheses[a]), own.visible.size() != 0 ? own.visible.maxCoeff() : 0.0,
                              effect_parameters(robot.chain, *hypotheses[a].effect).front().unit});
  }
  return limits;
}

}  // namespace llmt::robotics
