#include "discovery/described.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/still_joints.hpp"
#include "discovery/gap_map.hpp"
#include "discovery/investigation/unsound_effects.hpp"

namespace llmt::robotics {

Discovery described(Discovery result, const Findings& found, const std::vector<Objection>& objections,
                    const PoseSplit& split) {
  const Investigation& last = found.investigation;
  const Decision decision = decide(found.verdict, objections, found.names);
  result.answer = decision.answer;
  result.headline = decision.headline;
  const Measurements kept = without_rows(split.samples, last.verdict.outliers);
  const double missing_mm = total_distance(result.before, kept) / std::sqrt(static_cast<double>(kept.count()));
  for (std::size_t k = 0; k < found.names.size(); ++k) {
    FoundEffect& effect = result.effects.emplace_back(found.names[k].effect);
    effect.confirmed = decision.confirmed[k];
    // Shares of the search are of first order, and may exceed all that is missing by a little.
    effect.rms_mm = std::min(effect.rms_mm, missing_mm);
    effect.family_rms_mm = std::min(effect.family_rms_mm, missing_mm);
  }
  result.unknown = found.unknown;
  for (const Objection& one : objections) {
    result.unknown.insert(result.unknown.end(), one.unknown.begin(), one.unknown.end());
  }
  result.more = patterns_left(found);
  result.beyond_plausible = beyond_plausible(last, result.before);
  result.gap = gap_map(result.before, kept);
  for (const std::size_t sample : last.verdict.outliers) {
    result.outliers.insert(result.outliers.end(), split.rows[sample].begin(), split.rows[sample].end());
  }
  result.still = still_joints(result.before.chain, split.searched.poses);
  Limits limits = limits_of(last, result.before);
  result.not_testable = std::move(limits.not_testable);
  result.visible = std::move(limits.visible);
  result.score_gain = last.verdict.score_gain;
  result.threshold = last.verdict.threshold;
  result.hypotheses = static_cast<int>(last.asked.hypotheses.size());
  result.rounds = last.rounds;
  return result;
}

}  // namespace llmt::robotics
