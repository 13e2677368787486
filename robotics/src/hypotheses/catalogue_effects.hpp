// The effects of the catalogue at every place of a robot, as hypotheses.
#pragma once

#include <vector>

#include "hypotheses/hypothesis.hpp"
#include "hypotheses/scene.hpp"

namespace llmt::robotics {

/// Effects of the catalogue at every place that suits them, without their signatures. Effects whose columns are missing
/// are listed in `untestable`. Errors of the instrument are left out where all readings are of sockets and planes, and
/// counterbalance springs at axes that are upright: there they would be eccentricities by another name.
std::vector<Hypothesis> catalogue_hypotheses(const Scene& scene, const std::vector<EffectType>& catalogue,
                                             std::vector<discovery::UntestableCause>& untestable);

/// Signatures of all hypotheses that have an effect.
void add_signatures(const Scene& scene, std::vector<Hypothesis>& hypotheses);

}  // namespace llmt::robotics
