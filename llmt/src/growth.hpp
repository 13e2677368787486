/// \file
/// Best-first growth of one partition.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/fit.hpp"
#include "node_fit.hpp"

namespace llmt {

/// The rows that a tree is grown from, and options without defaults left to fill in.
struct GrowthProblem {
  Eigen::MatrixXd split_values;  ///< rows x split inputs; NaN: missing
  std::vector<int> num_levels;   ///< of each split input; 0: a number
  RowMajor deviations;           ///< rows x regressors, as deviations from their centres; NaN: missing
  Eigen::MatrixXd outputs;       ///< rows x outputs of the partition
  Eigen::VectorXd weights;       ///< of the rows, positive, with mean 1
  GrowthOptions options;         ///< split_inputs listed, min_leaf_samples set
  int max_threads = 0;
};

struct GrownPartition {
  std::vector<Node> nodes;  ///< split_input as in GrowthOptions::split_inputs; thresholds in the inputs' units
  StopReason stop = StopReason::leaf_samples;
};

GrownPartition grow(const GrowthProblem& problem);

}  // namespace llmt
