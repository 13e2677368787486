// The effects of the catalogue at every place of a robot, as hypotheses.
#pragma once

#include <vector>

#include "hypotheses/hypothesis.hpp"
#include "hypotheses/scene.hpp"

namespace llmt::robotics {

/// Effects of the catalogue where they can be, without their signatures; what cannot is told in `untestable`.
std::vector<Hypothesis> catalogue_hypotheses(const Scene& scene, const std::vector<EffectType>& catalogue,
                                             std::vector<UntestableEffect>& untestable);

/// Signatures of all hypotheses that have an effect.
void add_signatures(const Scene& scene, std::vector<Hypothesis>& hypotheses);

}  // namespace llmt::robotics
