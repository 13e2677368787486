// A growth rule for the test of the table of rules: every leaf is split at the median of the first split input.
#pragma once

#include "growth/problem.hpp"

namespace toy_rule {

/// Grows level by level up to max_leaves leaves (0: 8) of at least min_leaf_samples rows. Local models are least
/// squares.
llmt::GrownPartition grow_halves(const llmt::GrowthProblem& problem);

}  // namespace toy_rule
