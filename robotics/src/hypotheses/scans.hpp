// Effects with an inner unknown that is found by looking at the residuals: orders of transmission errors, rows of
// knocks.
#pragma once

#include <vector>

#include "hypotheses/hypothesis.hpp"
#include "hypotheses/scene.hpp"

namespace llmt::robotics {

/// Transmission errors of the orders, and tracker knocks at the rows, that explain most of the residuals: the best few.
/// The prior cost of each accounts for the number of orders or rows that it was chosen from.
std::vector<Hypothesis> scanned_effects(const Scene& scene, const std::vector<EffectType>& catalogue);

}  // namespace llmt::robotics
