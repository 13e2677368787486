/// \file
/// Rows of one leaf together.
#pragma once

#include <vector>

#include "data/dataset.hpp"
#include "partition/evaluator.hpp"

namespace llmt {

/// The leaves, from left to right in the tree.
std::vector<int> leaves_from_left(const Partition& partition);

/// Positions among `rows`: those in one leaf's box together, and neighbouring leaves near each other. Then few leaves
/// reach the rows of a short stretch, and the products of their validities are hardly ever 0.
std::vector<int> rows_by_leaf(const TrainingRows& rows, const Partition& partition, const Evaluator& evaluator,
                              int max_threads);

}  // namespace llmt
