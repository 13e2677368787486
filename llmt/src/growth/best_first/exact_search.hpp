/// \file
/// The best split of a leaf that holds the values of its own rows.
#pragma once

#include "growth/best_first/exact_leaf.hpp"
#include "growth/search/split_search.hpp"
#include "numerics/node_fit.hpp"

namespace llmt {

/// The best split over all split inputs, acceptable or not. `fit`: of the leaf's rows; `leaf.residuals`: those of the
/// leaf's own model; `rss`: of that model, weighted over the outputs.
///
/// RD and RETIS compare all thresholds (docs/algorithms/split-search.md); RA chooses the threshold by the signs of the
/// residuals (docs/algorithms/residual-analysis.md). Levels, and that a value is missing, are compared by the RSS for
/// all rules.
SplitCandidate find_split(const GrowthData& data, const ExactLeaf& leaf, const NodeFit& fit, double rss);

}  // namespace llmt
