/// \file
/// Models of the nodes of M5' and pruning by the adjusted error (docs/algorithms/m5.md).
#pragma once

#include "growth/m5/tree.hpp"

namespace llmt {

/// Fits the model of every node and, from the leaves up, lets it take the place of the subtree below unless the subtree
/// has the smaller adjusted error (Q.2). `deviations`: of the regressors, all training rows x regressors; NaN: missing.
/// True if a split was removed.
bool prune_m5_tree(const GrowthData& data, const RowMajor& deviations, M5Tree& tree);

}  // namespace llmt
