/// \file
/// Directions in which what a sum of trees says changes most.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "boosted/boosting.hpp"
#include "boosted/boosting_data.hpp"

namespace llmt {

/// Sums of numeric inputs with factors: the eigenvectors of the mean outer product of gradients, (J.13) in
/// docs/algorithms/boosting.md (Samarov 1993; Xia et al. 2002), of a sum of `trees` on the features `rows`. `inputs`:
/// numeric ones, at least two, of whose standardised values the gradients are taken. The largest eigenvalue is first;
/// an eigenvector of one input alone is left out.
std::vector<BoostedFeature> directions_of(const std::vector<GrowingTree>& trees, const BinnedRows& rows,
                                          const BoostingData& data, const std::vector<int>& inputs);

}  // namespace llmt
