/// \file
/// What a growth rule is given and what it returns.
#pragma once

#include <vector>

#include "data/dataset.hpp"
#include "llmt/summary.hpp"

namespace llmt {

/// What a tree is grown from.
struct GrowthProblem {
  const TrainingRows* training = nullptr;
  std::vector<int> outputs;  ///< that the partition serves
  GrowthOptions options;     ///< split_inputs listed, min_leaf_samples set
  int max_threads = 0;
};

struct GrownPartition {
  std::vector<Node> nodes;  ///< thresholds in the inputs' units; ranges (low, high) as far as they are known
  StopReason stop = StopReason::leaf_samples;
  SearchSummary search = {};
  /// By how much the split of every node lowered the weighted sum of squares that the rule looks at, 0 for leaves.
  std::vector<double> gains = {};
};

}  // namespace llmt
