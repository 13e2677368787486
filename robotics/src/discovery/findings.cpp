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

}  // namespace

void describe_shapes(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict, Discovery& result) {
  for (const discovery::Finding& finding : verdict.findings) {
    for (const discovery::FindingTerm& term : finding.terms) {
      if (finding.generic) result.unknown.push_back({hypotheses[term.candidate].shape, term.share});
    }
  }
  std::ranges::stable_sort(result.unknown, std::greater<>{}, &FoundShape::share);
}

void describe_effects(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict,
                      const Calibration& fitted, double mass_uncertainty, Discovery& result) {
  const double explained = verdict.sum_of_squares - verdict.left;
  const auto samples = static_cast<double>(std::max<Eigen::Index>(1, fitted.result.residuals.size() / 3));
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
      // Beside something unknown a name is a guess.
      found.confirmed = finding.confirmed && result.answer != discovery::Answer::unknown;
      found.share = finding.terms.size() == 1 ? finding.share : term.share;
      found.rms_mm = std::sqrt(std::max(0.0, found.share * explained) / samples);
      found.parameters = parameters_of(found.effect, fitted, mass_uncertainty);
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
