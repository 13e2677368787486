#include "discovery/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

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
    // Calibration holds what does not move the tool: its value is not determined.
    const double error = fitted.result.standard_errors(index);
    const double known = effect_type(effect.type).weighted ? mass_uncertainty * value : 0.0;
    found.push_back({parameter.name, value, parameter.unit,
                     error > 0.0 ? std::hypot(error, known) : std::numeric_limits<double>::quiet_NaN()});
  }
  return found;
}

// Whether any value is more than two standard errors away from nothing: an effect that the fit of all together puts at
// nothing is not there.
bool is_determined(const std::vector<FoundParameter>& found) {
  return std::ranges::any_of(
      found, [](const FoundParameter& one) { return !(std::abs(one.value) < 2.0 * one.standard_error); });
}

// Whether what the effect explains may be a piece of the shape: both depend on the posture, or both on time or load.
bool may_be_part_of(const Shape& shape, const Effect& effect) {
  bool posture = true;
  bool load = false;
  for (const std::string& input : shape.depends_on) {
    load = load || input == "payload_kg";
    posture = posture && input != "time_s" && input != "order" && input != "temp_C" && input != "payload_kg";
  }
  // No smooth shape and no map follows a wave of many periods.
  constexpr double finest = 90.0;  // waves a turn that knots every two degrees can follow
  if (effect.type == "transmission_error" && effect.constants[0] > finest) return false;
  const std::vector<std::string>& columns = effect_type(effect.type).columns;
  const bool is_of_posture = columns.empty() || columns.front().starts_with("tau");
  if (is_of_posture) return posture || load;
  return !posture && depends_on_time(effect.type);
}

}  // namespace

void describe_shapes(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict,
                     std::vector<FoundShape>& shapes) {
  for (const discovery::Finding& finding : verdict.findings) {
    for (const discovery::FindingTerm& term : finding.terms) {
      if (finding.generic) shapes.push_back({hypotheses[term.candidate].shape, term.share});
    }
  }
  std::ranges::stable_sort(shapes, std::greater<>{}, &FoundShape::share);
}

void describe_effects(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict,
                      const Calibration& fitted, double mass_uncertainty, Discovery& result) {
  const double explained = verdict.sum_of_squares - verdict.left;
  const auto samples = static_cast<double>(std::max<Eigen::Index>(1, fitted.result.residuals.size() / 3));
  double in_shapes = 0.0;
  for (const discovery::Finding& finding : verdict.findings) in_shapes += finding.generic ? finding.share : 0.0;
  std::vector<FoundShape> shapes = result.unknown;
  describe_shapes(hypotheses, verdict, shapes);
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
      // Beside something unknown a name is a guess, unless nearly all that was explained goes with it alone and it is
      // no piece of the unknown.
      constexpr double most = 0.8;
      const bool stands_alone = result.answer != discovery::Answer::unknown;
      const bool is_piece = std::ranges::any_of(
          shapes, [&](const FoundShape& one) { return may_be_part_of(one.shape, *hypothesis.effect); });
      found.confirmed = stands_alone ? finding.confirmed : finding.share > most && in_shapes < 1.0 - most && !is_piece;
      found.parameters = parameters_of(found.effect, fitted, mass_uncertainty);
      if (!is_determined(found.parameters)) found.confirmed = false;
      found.share = finding.terms.size() == 1 ? finding.share : term.share;
      found.rms_mm = std::sqrt(std::max(0.0, found.share * explained) / samples);
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
      result.effects.push_back(std::move(found));
    }
  }
}

void describe_smaller(const SecondLook& look, const std::vector<Hypothesis>& large, const discovery::Verdict& verdict,
                      const Calibration& fitted, const DiscoveryOptions& options, Discovery& result) {
  describe_shapes(look.asked.hypotheses, look.verdict, result.more);
  if (look.verdict.answer == discovery::Answer::unknown) return;
  const std::size_t first = result.effects.size();
  describe_effects(look.asked.hypotheses, look.verdict, fitted, options.mass_uncertainty, result);
  const double explained = verdict.sum_of_squares - verdict.left;
  const double part = explained > 0.0 ? (look.verdict.sum_of_squares - look.verdict.left) / explained : 1.0;
  for (std::size_t e = first; e < result.effects.size(); ++e) {
    FoundEffect& effect = result.effects[e];
    effect.smaller = true;
    effect.share *= part;
    if (effect.share < options.search.model_error && may_be_an_error_of(large, effect.effect)) effect.confirmed = false;
    if (effect.confirmed && !effect.rivals.empty()) result.answer = discovery::Answer::indistinguishable;
  }
  result.noise_mm = look.verdict.noise;
}

void describe_refused(const Investigation& investigation, const Robot& robot, Discovery& result) {
  const auto add = [&](Effect effect, const discovery::EffectCandidate& limits) {
    const EffectType& type = effect_type(effect.type);
    const auto same_family = [&](const auto& one) { return effect_type(one.effect.type).family == type.family; };
    if (limits.lower.size() == 0 || std::ranges::any_of(result.beyond_plausible, same_family)) return;
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
    // A stiffness below nothing is no size.
    if (farthest == 0.0 || beyond.limit == 0.0) return;
    beyond.title = type.title;
    beyond.effect = std::move(effect);
    result.beyond_plausible.push_back(std::move(beyond));
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
}

void describe_limits(const std::vector<Hypothesis>& hypotheses,
                     const std::vector<discovery::UntestableCause>& untestable, const discovery::Verdict& verdict,
                     const Robot& robot, Discovery& result) {
  result.hypotheses = static_cast<int>(hypotheses.size());
  result.score_gain = verdict.score_gain;
  result.threshold = verdict.threshold;
  result.noise_mm = verdict.noise;
  result.lack_of_fit = verdict.lack_of_fit;
  result.not_testable = untestable;
  for (std::size_t a = 0; a < hypotheses.size(); ++a) {
    if (!hypotheses[a].effect) continue;
    const discovery::Sensitivity& own = verdict.sensitivity[a];
    if (own.absorbed) {
      result.not_testable.push_back(
          {label_of(hypotheses[a]), "geometry, or what is in the model already, imitates it at these poses"});
      continue;
    }
    result.visible.push_back({label_of(hypotheses[a]), own.visible.size() != 0 ? own.visible.maxCoeff() : 0.0,
                              effect_parameters(robot.chain, *hypotheses[a].effect).front().unit});
  }
}

}  // namespace llmt::robotics
