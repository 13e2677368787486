// Effects with an inner unknown that is found by looking at the residuals: orders of transmission errors, rows of
// knocks.
#pragma once

#include <vector>

#include "hypotheses/hypothesis.hpp"
#include "hypotheses/scene.hpp"

namespace llmt::robotics {

/// Transmission errors of the orders that the residuals show, tracker knocks at the rows where they show: the best few,
/// each with how many it was chosen from.
std::vector<Hypothesis> scanned_effects(const Scene& scene, const std::vector<EffectType>& catalogue);

}  // namespace llmt::robotics
