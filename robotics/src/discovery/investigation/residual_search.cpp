#include "discovery/investigation/residual_search.hpp"

#include <algorithm>

#include "discovery/investigation/leave_one_out.hpp"
#include "discovery/investigation/pose_split.hpp"
#include "discovery/investigation/unsound_effects.hpp"

namespace llmt::robotics {

bool depends_on_time(const Effect& effect) {
  const Nature nature = nature_of(effect);
  return nature == Nature::time || nature == Nature::jump;
}

bool may_be_an_error_of(const std::vector<Hypothesis>& large, const Effect& small) {
  const Nature nature = nature_of(small);
  return std::ranges::any_of(large, [&](const Hypothesis& one) {
    const Effect& effect = *one.effect;
    const bool by_weight = nature_of(effect) == Nature::weight;
    return (!effect.at.empty() && effect.at == small.at) ||
           effect_type(effect.type).family == effect_type(small.type).family ||
           (depends_on_time(effect) && depends_on_time(small)) ||
           (by_weight && (nature == Nature::weight || nature == Nature::slow));
  });
}

std::optional<ResidualSearch> search_residuals(Investigation& investigation, const DiscoveryOptions& options) {
  report_progress(*investigation.work, "searching the residuals");
  ResidualSearch search{question(investigation.fitted.robot, {}, investigation.kept(), options), {}};
  exclude_effects(investigation.implausible, search.asked);
  search.verdict = discovery::search(search.asked.evidence, candidates_of(search.asked), options.search);
  if (search.verdict.answer == discovery::Answer::nothing_missing) return std::nullopt;
  const std::vector<Hypothesis> more = effects_of(search.asked, search.verdict);
  forget_signatures(search.asked);
  // Beside a pattern names are guesses.
  if (search.verdict.answer == discovery::Answer::unknown || more.empty()) return search;
  std::vector<Hypothesis> all = investigation.found;
  for (Hypothesis& one : all) {
    // The fit starts where the one before ended.
    const std::vector<Effect>& effects = investigation.fitted.robot.effects;
    const auto fitted = std::ranges::find(effects, effect_label(*one.effect), effect_label);
    if (fitted != effects.end()) one.effect->values = fitted->values;
  }
  all.insert(all.end(), more.begin(), more.end());
  Calibration fitted =
      refit(investigation.baseline, all, investigation.searched, investigation.verdict.outliers, options);
  bool is_refused = false;
  bool is_new = false;
  for (const Effect& effect : unsound(investigation.baseline, fitted, all, investigation.kept())) {
    is_refused = true;
    is_new = investigation.implausible.try_emplace(effect_label(effect), effect).second || is_new;
  }
  if (is_refused) return is_new ? search_residuals(investigation, options) : std::nullopt;
  const std::vector<std::size_t> skipped = investigation.outliers();
  const auto error = [&](const Calibration& one) {
    Eigen::VectorXd errors = leave_one_out_distances(one, investigation.searched, skipped);
    for (const std::size_t sample : skipped) errors(static_cast<Eigen::Index>(sample)) = 0.0;
    return errors.squaredNorm();
  };
  if (!(error(fitted) < error(investigation.fitted))) return std::nullopt;
  investigation.found = std::move(all);
  investigation.fitted = std::move(fitted);
  return search;
}

}  // namespace llmt::robotics
