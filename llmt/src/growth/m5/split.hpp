/// \file
/// The split of M5': the largest decrease of the scatter of the outputs (docs/algorithms/m5.md, Q.1).
#pragma once

#include <vector>

#include "growth/growth_data.hpp"

namespace llmt {

/// A split of some rows.
struct DeviationSplit {
  int input = -1;                    ///< position among the split inputs; -1: there is no admissible split
  double threshold = 0.0;            ///< of a number: the middle of the gap
  bool by_missing = false;           ///< rows with a value go left, rows without one right
  std::vector<int> level_side = {};  ///< of a categorical input: -1 left, 1 right, 0 not seen
  /// n I - n_1 I_1 - n_2 I_2 over the rows that have a value, with I the fifth root of an output's variance, as a part
  /// of that of all training rows, added up over the outputs; n are sums of weights.
  double decrease = 0.0;
};

/// Rows of a node.
struct DeviationNode {
  const std::vector<int>& rows;                 ///< of the training rows
  const std::vector<std::vector<int>>& orders;  ///< of each numeric split input, those that have a value, ascending
  const Eigen::VectorXd& weights;               ///< of all training rows, as they count in this node
};

/// Sum over the outputs of their standard deviations (division by n), as parts of those of all training rows.
double relative_deviation(const GrowthData& data, const DeviationNode& node);

/// Compares every threshold between two distinct values that leaves `min_leaf_samples` and a fifth of the rows with a
/// value on either side; levels alike, in the order of their means of each output; and rows with against rows without a
/// value. Equally good: the first input, then the smallest threshold.
DeviationSplit largest_decrease(const GrowthData& data, const DeviationNode& node);

}  // namespace llmt
