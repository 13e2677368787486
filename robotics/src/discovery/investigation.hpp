// Search and refit, round after round, on one set of poses.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "discovery/question.hpp"
#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {

struct Investigation {
  Work* work = nullptr;                       ///< of the discovery
  Measurements searched;                      ///< joint values moved by the maps there are
  Calibration baseline;                       ///< without what was found
  std::vector<std::size_t> baseline_without;  ///< samples that the baseline was made without, ascending
  /// Those of them that are left out before the search looks at anything: several of the same size hide each other, and
  /// next to endless ones a gap looks like rounding. They are outliers.
  std::vector<std::size_t> refused;
  Calibration fitted;  ///< with what was found
  std::vector<Hypothesis> found;
  discovery::Verdict verdict;
  EffectQuestion asked;  ///< its hypotheses without their signatures
  int rounds = 0;
  bool settled = false;  ///< the last two rounds said the same
  /// Effects that ended beyond their plausible size when everything was fitted together, by label. They are not found
  /// again.
  std::map<std::string, Effect> implausible;

  /// Until names and outliers no longer change. Where they do not settle, the round is kept whose refit has the
  /// smallest error on poses left out.
  void search(const DiscoveryOptions& options);
  void apply(const std::vector<Effect>& maps);
};

/// Fits the robot with the found effects, starting from the registered frames; if that is worse than geometry alone,
/// from the calibrated geometry, and the better one is kept.
Calibration refit(const Calibration& baseline, const std::vector<Hypothesis>& found, const Measurements& measurements,
                  const std::vector<std::size_t>& outliers, const DiscoveryOptions& options);

/// Effects that were fitted to sizes beyond the plausible ones, by more than two standard errors.
std::vector<Effect> too_large(const Calibration& fitted, const std::vector<Hypothesis>& found);

/// Adds joint maps to what was found if they lower the error on poses left out, then searches once more: an effect that
/// the maps cannot imitate may show only now.
void add_maps(Investigation& investigation, const DiscoveryOptions& options, Discovery& result);

/// Counts the step that ends as a part of the work that is left, for how many there will be is not known, and names the
/// one that begins.
void begin(const Investigation& investigation, const std::string& step);

/// Root of the sum of squared distances between model and measurement, mm.
double total_distance(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
