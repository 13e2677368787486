/// \file
/// Features of several inputs: sums and differences of features, and directions.
#pragma once

#include <vector>

#include "boosted/boosting_data.hpp"
#include "boosted/growing_tree.hpp"

namespace llmt {

/// The features of numbers that symmetric trees on `rows` split most often, counted once a level; ascending.
std::vector<int> most_used(const BinnedRows& rows, const std::vector<GrowingTree>& trees, std::size_t most);

/// `rows` with the sum and the difference of each two of `features`.
BinnedRows with_pairs(const BoostingData& data, BinnedRows rows, const std::vector<int>& features);

/// The rows of `data` with the directions of a sum of `trees` on `rows`, directions_of(), in the inputs of numbers that
/// are used most by `symmetric` trees on the rows of `data`. As they are where there are no two such inputs.
BinnedRows with_directions(const BoostingData& data, const std::vector<GrowingTree>& symmetric,
                           const std::vector<GrowingTree>& trees, const BinnedRows& rows);

}  // namespace llmt
