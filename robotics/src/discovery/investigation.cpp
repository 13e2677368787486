#include "discovery/investigation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "calibration/joint_map_shift.hpp"
#include "discovery/joint_maps.hpp"
#include "discovery/left_out.hpp"
#include "discovery/pose_split.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

// What a round says: names, and samples that fit nothing.
struct Saying {
  std::set<std::string> labels;
  std::set<std::size_t> outliers;
  bool operator==(const Saying&) const = default;
  bool operator<(const Saying& other) const {
    return labels != other.labels ? labels < other.labels : outliers < other.outliers;
  }
};

std::set<std::string> labels_of(const std::vector<Hypothesis>& found) {
  std::set<std::string> labels;
  for (const Hypothesis& hypothesis : found) labels.insert(effect_label(*hypothesis.effect));
  return labels;
}

// Of a thousand poses some are outliers in one round and not in the next.
bool is_negligible(const std::set<std::size_t>& one, const std::set<std::size_t>& other, Eigen::Index samples) {
  std::vector<std::size_t> differing;
  std::ranges::set_symmetric_difference(one, other, std::back_inserter(differing));
  return std::ssize(differing) * 100 <= samples;
}

// Names of what was found. An exact alias is the same answer under another name, which rounding may choose.
std::set<std::string> names_in(const EffectQuestion& asked, const discovery::Verdict& verdict) {
  std::set<std::string> names;
  for (const discovery::Finding& finding : verdict.findings) {
    for (const discovery::FindingTerm& term : finding.terms) {
      if (!asked.hypotheses[term.candidate].effect) continue;
      std::string name = effect_label(*asked.hypotheses[term.candidate].effect);
      for (const discovery::Rival& rival : finding.rivals) {
        const bool stands_in = rival.exact && rival.candidates.size() == 1 && finding.terms.size() == 1;
        if (stands_in) name = std::min(name, effect_label(*asked.hypotheses[rival.candidates[0]].effect));
      }
      names.insert(std::move(name));
    }
  }
  return names;
}

std::vector<std::size_t> ascending(std::vector<std::size_t> samples) {
  std::ranges::sort(samples);
  return samples;
}

// A shape that contains a cause explains always a little more. Where shapes are the answer and causes explain nearly as
// much, the causes are. `preferred`: whether it was so the round before; asked in the first round and then as long as
// it is.
discovery::Verdict search_causes_first(const EffectQuestion& asked, const DiscoveryOptions& options, int round,
                                       bool& preferred) {
  const std::vector<discovery::EffectCandidate> candidates = candidates_of(asked);
  if (round > 0 && !preferred) return discovery::search(asked.evidence, candidates, options.search);
  constexpr double nearly = 0.02;  // of the evidence
  discovery::SearchOptions lenient = options.search;
  lenient.shape_share = nearly;
  discovery::Verdict verdict = discovery::search(asked.evidence, candidates, lenient);
  const bool is_named =
      verdict.answer != discovery::Answer::unknown && verdict.answer != discovery::Answer::nothing_missing;
  preferred = is_named && verdict.causes_preferred;
  if (!verdict.causes_preferred || is_named) return verdict;
  return discovery::search(asked.evidence, candidates, options.search);
}

// Samples that the baseline was made without, endlessly far off, and that are to be left out before the search looks at
// anything: those that are as far off as before whatever was found, because several of the same size hide each other;
// and those that were left out, because next to them a gap looks like rounding.
std::vector<std::size_t> to_refuse(const Investigation& now) {
  const Eigen::Index d = std::ranges::count(now.searched.measured, true);
  const Eigen::VectorXd before = distances(positions(now.baseline.robot, now.searched.poses), now.searched);
  const double typical = median(before);
  std::vector<std::size_t> far;
  Eigen::Index asked = 0;  // number of the sample in the question
  for (std::size_t i = 0; i < static_cast<std::size_t>(now.searched.count()); ++i) {
    if (std::ranges::binary_search(now.refused, i)) continue;
    const auto number = static_cast<std::size_t>(asked);
    const double left = now.verdict.remaining.segment(d * asked++, d).norm();
    if (!std::ranges::binary_search(now.baseline_without, i)) continue;
    const double length = before(static_cast<Eigen::Index>(i));
    const bool is_left_out = std::ranges::find(now.verdict.outliers, number) != now.verdict.outliers.end();
    constexpr double hardly = 0.5;
    constexpr double endless = 100.0;  // no effect that acts at few poses is as large as that
    if (length > endless * typical && (is_left_out || left > hardly * length)) far.push_back(i);
  }
  return far;
}

// Outliers by their numbers among all samples, not among those asked for, and the refused ones.
void number_among_all(const std::vector<std::size_t>& refused, Eigen::Index samples,
                      std::vector<std::size_t>& outliers) {
  if (refused.empty()) return;
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < static_cast<std::size_t>(samples); ++i) {
    if (!std::ranges::binary_search(refused, i)) numbers.push_back(i);
  }
  for (std::size_t& sample : outliers) sample = numbers[sample];
  outliers.insert(outliers.end(), refused.begin(), refused.end());
}

struct Round {
  EffectQuestion asked;
  discovery::Verdict verdict;
  std::vector<Hypothesis> found;
  Calibration fitted;
  Eigen::VectorXd errors;  // of every pose, left out
};

// Sum of squared errors on poses left out, none of them longer than what a few outliers of any round are.
std::size_t best_of(const std::vector<Round>& rounds) {
  double typical = std::numeric_limits<double>::infinity();
  for (const Round& round : rounds) {
    typical = std::min(typical, median(round.errors));
  }
  constexpr double longest = 6.0;
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < rounds.size(); ++k) {
    const double sum = rounds[k].errors.cwiseMin(longest * typical).squaredNorm();
    if (sum >= least) continue;
    least = sum;
    best = k;
  }
  return best;
}

}  // namespace

void begin(const Investigation& investigation, const std::string& step) {
  constexpr double share_of_step = 0.15;
  investigation.work->did(share_of_step * investigation.work->left());
  investigation.work->begin(step);
}

double total_distance(const Robot& robot, const Measurements& measurements) {
  return distances(positions(robot, measurements.poses), measurements).norm();
}

Calibration refit(const Calibration& baseline, const std::vector<Hypothesis>& found, const Measurements& measurements,
                  const std::vector<std::size_t>& outliers, const DiscoveryOptions& options) {
  const Measurements kept = without_rows(measurements, outliers);
  CalibrationOptions calibration = options.calibration;
  calibration.start_as_given = true;
  const auto from = [&](Robot start) {
    for (const Hypothesis& hypothesis : found) start.effects.push_back(*hypothesis.effect);
    return calibrate(start, kept, calibration);
  };
  Calibration fitted = from(baseline.registered);
  if (total_distance(fitted.robot, kept) <= total_distance(baseline.robot, kept)) return fitted;
  Calibration other = from(baseline.robot);
  return total_distance(other.robot, kept) < total_distance(fitted.robot, kept) ? other : fitted;
}

std::vector<Effect> too_large(const Calibration& fitted, const std::vector<Hypothesis>& found) {
  const std::vector<discovery::Parameter> all = parameters(fitted.robot);
  std::vector<Effect> beyond;
  for (const Hypothesis& hypothesis : found) {
    const discovery::EffectCandidate& limits = hypothesis.candidate;
    const auto effect = std::ranges::find(fitted.robot.effects, effect_label(*hypothesis.effect), effect_label);
    if (effect == fitted.robot.effects.end() || limits.lower.size() == 0) continue;
    const std::vector<EffectParameter> own = effect_parameters(fitted.robot.chain, *effect);
    for (std::size_t k = 0; k < own.size(); ++k) {
      const std::string name = effect_parameter_name(*effect, own[k]);
      const auto index = std::ranges::find(all, name, &discovery::Parameter::name) - all.begin();
      const double error = 2.0 * fitted.result.standard_errors(index);
      const double value = effect->values[k];
      const auto i = static_cast<Eigen::Index>(k);
      // An error that is not finite: the value is not determined.
      if (!(value + error < limits.lower(i)) && !(value - error > limits.upper(i))) continue;
      beyond.push_back(*effect);
      break;
    }
  }
  return beyond;
}

void Investigation::search(const DiscoveryOptions& options) {
  if (found.empty()) fitted = baseline;
  settled = false;
  Saying last{labels_of(found), {baseline_without.begin(), baseline_without.end()}};
  std::set<Saying> said;
  std::vector<Round> tried;
  bool preferred = false;
  for (int round = 0; round < options.rounds && !settled; ++round) {
    begin(*this, fmt::format("searching, round {}", ++rounds));
    asked = question(fitted.robot, found, without_rows(searched, refused), options);
    std::erase_if(asked.hypotheses,
                  [&](const Hypothesis& one) { return one.effect && implausible.contains(effect_label(*one.effect)); });
    verdict = search_causes_first(asked, options, round, preferred);
    work->check();
    const std::vector<std::size_t> hidden = to_refuse(*this);
    number_among_all(refused, searched.count(), verdict.outliers);
    if (!hidden.empty() && round + 1 < options.rounds) {
      refused.insert(refused.end(), hidden.begin(), hidden.end());
      std::ranges::sort(refused);
      continue;
    }
    found = effects_of(asked, verdict);
    forget_signatures(asked);
    const bool as_before = found.empty() && ascending(verdict.outliers) == baseline_without;
    fitted = as_before ? baseline : refit(baseline, found, searched, verdict.outliers, options);
    const std::vector<Effect> beyond = too_large(fitted, found);
    for (const Effect& effect : beyond) implausible.try_emplace(effect_label(effect), effect);
    Saying now{names_in(asked, verdict), {verdict.outliers.begin(), verdict.outliers.end()}};
    settled =
        beyond.empty() && now.labels == last.labels && is_negligible(now.outliers, last.outliers, searched.count());
    if (beyond.empty() && !settled) {
      tried.push_back({asked, verdict, found, fitted, left_out(fitted, searched, ascending(verdict.outliers))});
      if (!said.insert(now).second) break;
    }
    last = std::move(now);
  }
  if (settled || tried.empty()) return;
  Round& best = tried[best_of(tried)];
  asked = std::move(best.asked);
  verdict = std::move(best.verdict);
  found = std::move(best.found);
  fitted = std::move(best.fitted);
}

void Investigation::apply(const std::vector<Effect>& maps) {
  Robot mapped = baseline.registered;
  mapped.effects.insert(mapped.effects.end(), maps.begin(), maps.end());
  searched = unmapped(mapped, searched).measurements;
}

void add_maps(Investigation& investigation, const DiscoveryOptions& options, Discovery& result) {
  begin(investigation, "mapping the joints");
  const Measurements kept = without_rows(investigation.searched, investigation.verdict.outliers);
  const std::optional<JointMaps> maps = fit_joint_maps(investigation.fitted.robot, kept);
  constexpr double convincing = 2.0;
  if (!maps || maps->gain_in_errors < convincing) {
    result.notes.emplace_back(
        "Free maps of the joints (angle error over angle) would not lower the error on poses left out.");
    return;
  }
  result.maps = maps->effects;
  result.notes.push_back(
      fmt::format("Free maps of {} joints (angle error over angle) were added: they lower the error on poses left out.",
                  maps->effects.size()));
  investigation.apply(maps->effects);
  CalibrationOptions calibration = options.calibration;
  calibration.start_as_given = true;
  const std::vector<std::size_t> outliers = ascending(investigation.verdict.outliers);
  investigation.baseline =
      calibrate(investigation.baseline.registered, without_rows(investigation.searched, outliers), calibration);
  investigation.baseline_without = outliers;
  investigation.fitted = refit(investigation.baseline, investigation.found, investigation.searched,
                               investigation.verdict.outliers, options);
  investigation.search(options);
}

}  // namespace llmt::robotics
