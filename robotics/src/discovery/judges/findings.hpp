// The outcome of a search in the words of a robot: effects, patterns and limits.
#pragma once

#include <optional>
#include <vector>

#include "discovery/investigation/residual_search.hpp"
#include "discovery/judges/decision.hpp"
#include "hypotheses/hypothesis.hpp"

namespace llmt::robotics {

/// Everything that the searches on one set of poses ended with.
struct Findings {
  Investigation investigation;     ///< the last one; everything that was found is fitted together
  discovery::Answer verdict = {};  ///< of the first search, which is without joint maps
  std::vector<Hypothesis> larger;  ///< what was found before the residuals were searched
  std::optional<ResidualSearch> residual_search;
  std::vector<Name> names;
  std::vector<FoundPattern> unknown;   ///< patterns of the first search
  std::vector<Effect> maps;            ///< joint maps that were added
  std::optional<JointMaps> map_fit;    ///< their fit
  std::optional<Objection> harmonics;  ///< against waves, see judge_waves()
  std::vector<std::string> notes;

  /// True if something that has no name was known when the last search was made.
  bool is_beside_unknown() const { return verdict == discovery::Answer::unknown || !maps.empty(); }
};

/// True if the answer consists of names.
inline bool is_named(discovery::Answer answer) {
  return answer == discovery::Answer::named || answer == discovery::Answer::indistinguishable;
}

/// The patterns of a verdict, by falling share.
std::vector<FoundPattern> found_patterns(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict);

/// Patterns that the search of the residuals found: what is left beside names.
std::vector<FoundPattern> patterns_left(const Findings& found);

/// The effects of a verdict that the fit has.
std::vector<Name> named_effects(const std::vector<Hypothesis>& hypotheses, const discovery::Verdict& verdict,
                                const Calibration& fitted, double mass_uncertainty);

/// The effects that a search of the residuals added. Their shares are those of the sum of squares that `verdict`
/// explains, the verdict of the search before.
std::vector<Name> smaller_effects(const ResidualSearch& search, const discovery::Verdict& verdict,
                                  const Calibration& fitted, double mass_uncertainty);

/// Discovery::not_testable and Discovery::visible.
struct Limits {
  std::vector<discovery::UntestableCause> not_testable;
  std::vector<Visible> visible;
};

Limits limits_of(const Investigation& investigation, const Robot& robot);

/// Effects that the search refused for their size, and effects that ended too large when everything was fitted
/// together.
std::vector<BeyondPlausible> beyond_plausible(const Investigation& investigation, const Robot& robot);

}  // namespace llmt::robotics
