/// \file
/// How a split divides the rows of a leaf, rows without a value of the split input included.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "growth/best_first/exact_leaf.hpp"
#include "growth/search/split_search.hpp"

namespace llmt {

/// Where a row of a leaf goes. Both: it has no value of the split input.
enum class Side { left, right, both };

/// One entry per row of the leaf.
std::vector<Side> sides_of(const GrowthData& data, const ExactLeaf& leaf, const SplitCandidate& split);

/// Residuals of the parent's local model with missing regressors at the mean of these rows instead of the parent's
/// mean. `deviations`: rows x regressors; `residuals`: rows x outputs.
Eigen::MatrixXd about_own_mean(const RowMajor& deviations, const Node& parent, Eigen::MatrixXd residuals,
                               const Eigen::VectorXd& weights);

/// Node::missing_left of a leaf with the local model `node` (docs/algorithms/data.md, D.2). The children are fitted to
/// the rows that have a value.
double learn_missing_left(const GrowthData& data, const ExactLeaf& leaf, const Node& node,
                          const std::vector<Side>& sides);

}  // namespace llmt
