/// \file
/// M5' (docs/algorithms/m5.md): growth, pruning and smoothing.
#pragma once

#include "growth/problem.hpp"

namespace llmt {

/// Grows by the decrease of the outputs' scatter (Q.1), prunes by the adjusted error (Q.2) and folds the smoothing
/// along the path (Q.3) into the local models. The remaining splits stand in the order of best-first growth, the
/// largest decrease first. Every node has the smoothed model that it has as a leaf, so prefixes are models.
GrownPartition grow_m5(const GrowthProblem& problem);

}  // namespace llmt
