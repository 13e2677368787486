// One thing that could be missing from a robot model.
#pragma once

#include <optional>

#include "llmt/discovery/search.hpp"
#include "llmt/robotics/discovery/discovery_result.hpp"
#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {

/// A candidate of the search and what it means.
struct Hypothesis {
  discovery::EffectCandidate candidate;  ///< signature over all 3n coordinates
  std::optional<Effect> effect;          ///< what would be added to the robot; a pattern may have none
  ErrorPattern pattern;                  ///< of a generic candidate
};

/// Constants to try an effect with, as EffectType::trial says.
std::vector<std::vector<double>> constants_to_try(const EffectType& type, const TrialContext& context,
                                                  std::size_t index);

/// Plausible limits of an effect's values, by its type.
void set_limits(const EffectType& type, Eigen::Index values, discovery::EffectCandidate& candidate);

}  // namespace llmt::robotics
