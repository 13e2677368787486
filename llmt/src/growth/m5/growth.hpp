/// \file
/// M5': growth, pruning and smoothing.
#pragma once

#include "growth/best_first/best_first.hpp"

namespace llmt {

/// Grows by the decrease of the standard deviation, prunes by the adjusted error and folds the smoothing along the path
/// into the local models (docs/algorithms.md, "M5'"). The splits that are left stand in the order of best-first growth,
/// the largest decrease first, and every node has the smoothed model that it has as a leaf, so prefixes are models.
GrownPartition grow_m5(const GrowthProblem& problem);

}  // namespace llmt
