/// \file
/// Best-first growth of one partition (docs/algorithms/growth.md): RD, RETIS and residual analysis.
#pragma once

#include "growth/problem.hpp"

namespace llmt {

/// Grows a tree by splitting in each step the leaf whose best split lowers the RSS most. The nodes stand in the order
/// of growth.
GrownPartition grow(const GrowthProblem& problem);

}  // namespace llmt
