#include "discovery/investigation/investigation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "calibration/joint_map_shift.hpp"
#include "discovery/investigation/joint_maps.hpp"
#include "discovery/investigation/leave_one_out.hpp"
#include "discovery/investigation/pose_split.hpp"
#include "discovery/investigation/unsound_effects.hpp"
#include "llmt/discovery/rounds.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

discovery::RoundSummary start_of(const Investigation& investigation) {
  std::set<std::string> labels;
  for (const Hypothesis& hypothesis : investigation.found) labels.insert(effect_label(*hypothesis.effect));
  return {.names = {labels.begin(), labels.end()},
          .outliers = {investigation.baseline_without.begin(), investigation.baseline_without.end()}};
}

// Every name once. An exact alias is the same answer under another name, and rounding may choose between the two: the
// first one in the alphabet stands for both.
discovery::RoundSummary summary_of(const EffectQuestion& asked, const discovery::Verdict& verdict) {
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
  return {.names = {names.begin(), names.end()}, .outliers = {verdict.outliers.begin(), verdict.outliers.end()}};
}

// Searches, and prefers causes to patterns that explain hardly more: a pattern that contains a cause always explains a
// little more. `preferred` says whether the round before preferred causes. The preference is tried in the first round,
// and in later ones as long as it held.
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

// Poses more than 100 medians off that the first calibration left out. They are removed before the next round if the
// effects found do not halve their error, or if the search called them outliers.
std::vector<std::size_t> far_poses(const Investigation& now) {
  const Eigen::Index d = std::ranges::count(now.searched.measured, true);
  const Eigen::VectorXd before = distances(positions(now.baseline.robot, now.searched.poses), now.searched);
  const double typical = median(before);
  std::vector<std::size_t> far;
  Eigen::Index asked = 0;  // the sample's number in the question
  for (std::size_t i = 0; i < static_cast<std::size_t>(now.searched.count()); ++i) {
    if (std::ranges::binary_search(now.refused, i)) continue;
    const auto number = static_cast<std::size_t>(asked);
    const double left = now.verdict.remaining.segment(d * asked++, d).norm();
    if (!std::ranges::binary_search(now.baseline_without, i)) continue;
    const double length = before(static_cast<Eigen::Index>(i));
    const bool is_left_out = std::ranges::find(now.verdict.outliers, number) != now.verdict.outliers.end();
    constexpr double hardly = 0.5;
    constexpr double gross = 100.0;  // no effect that acts at few poses is as large as that
    if (length > gross * typical && (is_left_out || left > hardly * length)) far.push_back(i);
  }
  return far;
}

// Turns numbers of outliers in the question into numbers among all samples, and adds the refused samples.
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
};

// Remembers the effects of the refit that are unsound(). True if there are none.
bool refuse_unsound(Investigation& now) {
  const std::vector<Effect> refused = unsound(now.baseline, now.fitted, now.found, now.kept());
  for (const Effect& effect : refused) now.implausible.try_emplace(effect_label(effect), effect);
  return refused.empty();
}

// Something is missing, and every name for it was refused.
Investigation without_names(Investigation now, const DiscoveryOptions& options) {
  discovery::Verdict& verdict = now.verdict;
  std::erase_if(verdict.findings, [](const discovery::Finding& one) { return !one.generic; });
  verdict.answer = discovery::Answer::unknown;
  verdict.left = verdict.sum_of_squares;
  verdict.noise = std::sqrt(verdict.left / static_cast<double>(std::max<Eigen::Index>(1, verdict.dof)));
  now.found.clear();
  now.fitted = refit(now.baseline, {}, now.searched, verdict.outliers, options);
  return now;
}

std::vector<std::size_t> ascending(std::vector<std::size_t> samples) {
  std::ranges::sort(samples);
  return samples;
}

// The round with the smallest sum of squared leave-one-pose-out errors. No error counts for more than six medians, so
// that the rounds' outliers do not decide.
std::size_t best_of(const std::vector<Round>& rounds, const Measurements& searched) {
  double typical = std::numeric_limits<double>::infinity();
  std::vector<Eigen::VectorXd> errors;
  for (const Round& round : rounds) {
    errors.push_back(leave_one_out_distances(round.fitted, searched, ascending(round.verdict.outliers)));
    typical = std::min(typical, median(errors.back()));
  }
  constexpr double longest = 6.0;
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < rounds.size(); ++k) {
    const double sum = errors[k].cwiseMin(longest * typical).squaredNorm();
    if (sum >= least) continue;
    least = sum;
    best = k;
  }
  return best;
}

}  // namespace

std::vector<std::size_t> Investigation::outliers() const { return ascending(verdict.outliers); }

Measurements Investigation::kept() const { return without_rows(searched, outliers()); }

void report_progress(Work& work, const std::string& step) {
  constexpr double share_of_step = 0.15;
  work.did(share_of_step * work.left());
  work.begin(step);
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

Investigation search_in_rounds(Investigation now, const DiscoveryOptions& options) {
  if (now.found.empty()) now.fitted = now.baseline;
  std::vector<Round> tried;
  bool causes_preferred = false;
  const auto round = [&](int number) -> std::optional<discovery::RoundSummary> {
    report_progress(*now.work, fmt::format("searching, round {}", ++now.rounds));
    now.asked = question(now.fitted.robot, now.found, without_rows(now.searched, now.refused), options);
    exclude_effects(now.implausible, now.asked);
    now.verdict = search_causes_first(now.asked, options, number, causes_preferred);
    now.work->check();
    const std::vector<std::size_t> far = far_poses(now);
    number_among_all(now.refused, now.searched.count(), now.verdict.outliers);
    if (!far.empty() && number + 1 < options.rounds) {
      now.refused.insert(now.refused.end(), far.begin(), far.end());
      std::ranges::sort(now.refused);
      return std::nullopt;
    }
    now.found = effects_of(now.asked, now.verdict);
    forget_signatures(now.asked);
    const bool as_before = now.found.empty() && now.outliers() == now.baseline_without;
    now.fitted = as_before ? now.baseline : refit(now.baseline, now.found, now.searched, now.verdict.outliers, options);
    discovery::RoundSummary summary = summary_of(now.asked, now.verdict);
    summary.may_be_last = refuse_unsound(now);
    if (summary.may_be_last) {
      tried.push_back({now.asked, now.verdict, now.found, now.fitted});
    } else {
      now.found = tried.empty() ? std::vector<Hypothesis>{} : tried.back().found;
      now.fitted = tried.empty() ? now.baseline : tried.back().fitted;
    }
    return summary;
  };
  // One in a hundred poses may be an outlier in one round and not in the next.
  const auto negligible = static_cast<std::size_t>(now.searched.count() / 100);
  const discovery::RoundLimits limits{
      .most = options.rounds, .negligible_outliers = negligible, .stop_at_repeat = true};
  if (discovery::until_settled(limits, start_of(now), round)) return now;
  if (tried.empty()) return without_names(std::move(now), options);
  Round& best = tried[best_of(tried, now.searched)];
  now.asked = std::move(best.asked);
  now.verdict = std::move(best.verdict);
  now.found = std::move(best.found);
  now.fitted = std::move(best.fitted);
  return now;
}

std::optional<JointMaps> helpful_maps(const Investigation& investigation) {
  std::optional<JointMaps> maps =
      fit_joint_maps(investigation.fitted.robot, without_rows(investigation.searched, investigation.verdict.outliers));
  constexpr double convincing = 2.0;
  if (!maps || maps->gain_in_errors < convincing) return std::nullopt;
  return maps;
}

std::set<std::string> followed_by_maps(const Investigation& now, const JointMaps& maps) {
  constexpr double followed = 0.9;
  const Measurements kept = now.kept();
  Eigen::MatrixXd moved(std::ssize(measured_rows(kept)), std::ssize(now.found));
  for (Eigen::Index k = 0; k < moved.cols(); ++k) {
    moved.col(k) = beyond_geometry(now.fitted.robot, *now.found[k].effect, kept);
  }
  const Eigen::VectorXd left = beyond_maps(now.fitted.robot, kept, maps, moved);
  std::set<std::string> labels;
  for (Eigen::Index k = 0; k < moved.cols(); ++k) {
    if (left(k) < 1.0 - followed) labels.insert(effect_label(*now.found[k].effect));
  }
  return labels;
}

Investigation search_with_maps(Investigation now, const std::vector<Effect>& maps, const DiscoveryOptions& options) {
  Robot mapped = now.baseline.registered;
  mapped.effects.insert(mapped.effects.end(), maps.begin(), maps.end());
  now.searched = unmapped(mapped, now.searched).measurements;
  CalibrationOptions calibration = options.calibration;
  calibration.start_as_given = true;
  now.baseline = calibrate(now.baseline.registered, now.kept(), calibration);
  now.baseline_without = now.outliers();
  now.fitted = refit(now.baseline, now.found, now.searched, now.verdict.outliers, options);
  if (!refuse_unsound(now)) {
    now.found.clear();
    now.fitted = now.baseline;
  }
  return search_in_rounds(std::move(now), options);
}

}  // namespace llmt::robotics
