// One thing that could be missing from a robot model.
#pragma once

#include <optional>

#include "llmt/discovery/search.hpp"
#include "llmt/robotics/discovery_result.hpp"
#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {

/// A candidate of the search and what it means.
struct Hypothesis {
  discovery::EffectCandidate candidate;  ///< signature over all 3n coordinates
  std::optional<Effect> effect;          ///< what would be added to the robot; a shape may have none
  Shape shape;                           ///< of a generic candidate
};

/// Plausible limits of an effect's values, by its type.
void set_limits(const EffectType& type, Eigen::Index values, discovery::EffectCandidate& candidate);

}  // namespace llmt::robotics
