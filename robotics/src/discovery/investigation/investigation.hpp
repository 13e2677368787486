// Rounds of search and refit on one set of poses.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "discovery/investigation/joint_maps.hpp"
#include "discovery/investigation/question.hpp"
#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {

/// The state of a search. Samples are rows of `searched`.
struct Investigation {
  Work* work = nullptr;                       ///< of the discovery
  Measurements searched;                      ///< joint values moved by the maps there are
  Calibration baseline;                       ///< without what was found
  std::vector<std::size_t> baseline_without;  ///< samples that the baseline was made without, ascending
  /// Samples that the search does not see, ascending. They are outliers. Gross errors of the same size hide each other,
  /// and next to very large ones a gap looks like rounding.
  std::vector<std::size_t> refused;
  Calibration fitted;  ///< with what was found
  std::vector<Hypothesis> found;
  discovery::Verdict verdict;
  EffectQuestion asked;  ///< its hypotheses without their signatures
  int rounds = 0;
  /// Effects that unsound() refused after a refit, by label. They are not found again.
  std::map<std::string, Effect> implausible;

  /// Samples that fit nothing, ascending.
  std::vector<std::size_t> outliers() const;
  /// `searched` without the outliers.
  Measurements kept() const;
};

/// Searches and refits until names and outliers no longer change. A refit with unsound() effects is no round: the
/// search goes on without them from the last refit that is one. If the rounds do not settle, the one is kept whose
/// refit has the smallest leave-one-pose-out error; if there is none, nothing is named, and the answer is `unknown`.
Investigation search_in_rounds(Investigation investigation, const DiscoveryOptions& options);

/// Fits the robot with the found effects, starting from the registered frames. If that is worse than geometry alone, it
/// is fitted from the calibrated geometry too, and the better fit is kept.
Calibration refit(const Calibration& baseline, const std::vector<Hypothesis>& found, const Measurements& measurements,
                  const std::vector<std::size_t>& outliers, const DiscoveryOptions& options);

/// Joint maps that lower the leave-one-pose-out error by more than two standard errors, or none.
std::optional<JointMaps> helpful_maps(const Investigation& investigation);

/// Labels of the effects found of which maps as smooth as these follow nine tenths. Beside the maps their values are
/// arbitrary: effect and map may be large and cancel each other.
std::set<std::string> followed_by_maps(const Investigation& investigation, const JointMaps& maps);

/// Searches with the maps applied to the joint values. An effect that the maps cannot imitate may show only then.
Investigation search_with_maps(Investigation investigation, const std::vector<Effect>& maps,
                               const DiscoveryOptions& options);

/// Counts the step that ends as a share of the work that is left, because the number of steps is not known, and names
/// the step that begins.
void report_progress(Work& work, const std::string& step);

}  // namespace llmt::robotics
