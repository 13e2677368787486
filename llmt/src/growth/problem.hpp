/// \file
/// What a growth rule is given and what it returns.
#pragma once

#include <vector>

#include "data/dataset.hpp"
#include "llmt/options.hpp"
#include "llmt/progress.hpp"
#include "llmt/summary.hpp"

namespace llmt {

/// The options of FitOptions that growth reads, without blanks.
struct GrowthOptions {
  double significance = 1.0;  ///< 1 or more: no test; every_split: no demand at all
  Eigen::Index min_leaf_samples = 0;
  Eigen::Index max_leaves = 0;  ///< 0: no limit
  std::vector<int> split_inputs = {};
  SplitSearch search = SplitSearch::automatic;
};

/// How best-first growth chooses a split.
enum class SplitCriterion {
  f_test,         ///< RD: the smallest residual sum of squares, if it passes the F test
  smallest_rss,   ///< RETIS: the smallest residual sum of squares; the tree is pruned by m-estimates
  residual_signs  ///< RA: the input on which the signs of the residuals depend most, if the split passes the F test
};

/// What is done to the tree after it was grown. LOLIMOT and HILOMOT grow with the validities of the model to come.
struct AfterGrowth {
  double width = 0.0;  ///< the first candidate for Validity::width; 0 for crisp leaves
  bool joint = false;  ///< the local models will be estimated jointly
  /// No held-out rows will choose the number of leaves, so that AICc may.
  bool keeps_all_leaves = false;
  bool has_leaf_limit = false;  ///< the caller set FitOptions::max_leaves
};

/// What a tree is grown from.
struct GrowthProblem {
  const TrainingRows* training = nullptr;
  std::vector<int> outputs;  ///< that the partition serves
  GrowthOptions options;
  int max_threads = 0;
  SplitCriterion criterion = SplitCriterion::f_test;
  AfterGrowth after = {};
  Work* work = nullptr;  ///< that counts the growth of this tree

  /// Counts the search for the best split of a node with this number of rows.
  void searched(Eigen::Index rows) const;

  /// Reports within the search of a node, if it takes long, so that a fit can be cancelled there.
  void check(Eigen::Index rows) const;
};

struct GrownPartition {
  std::vector<Node> nodes;  ///< thresholds in the inputs' units; ranges (low, high) as far as they are known
  StopReason stop = StopReason::leaf_samples;
  SearchSummary search = {};
  /// By how much the split of every node lowered the weighted sum of squares that the rule looks at, 0 for leaves.
  std::vector<double> gains = {};
};

}  // namespace llmt
