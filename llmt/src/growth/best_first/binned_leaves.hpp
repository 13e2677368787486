/// \file
/// Leaves of a growing tree whose inputs are cut into bins.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "growth/best_first/histogram.hpp"

namespace llmt {

struct BinnedLeaf : WhitenedLeaf {
  std::optional<Histogram> histogram;  ///< if there is memory to keep it
};

/// The features of all rows stay in the basis of the root, so that the histogram of one child is that of its parent
/// less that of the other child. This subtraction loses digits where a node's RSS is small against the RSS of the model
/// whose residuals the features hold. There the node's own residuals take their place and its histogram is formed anew.
class BinnedLeaves {
 public:
  /// Whether the data can be binned: no missing values, no more than `most_bins` levels of an input.
  static bool possible(const GrowthData& data);

  explicit BinnedLeaves(const GrowthData& data);

  BinnedLeaf root() const;

  /// As ExactLeaves::examine(). `excess`: what a split inside a bin could gain on the best one at an edge, at most.
  SplitCandidate examine(BinnedLeaf& leaf, const Node& parent, Node& node, double& excess);

  /// Lets a leaf wait for its turn: its histogram is kept if there is memory for it.
  void wait(BinnedLeaf& leaf);

  /// Splits a leaf, whose histogram goes to its children.
  std::array<BinnedLeaf, 2> divide(BinnedLeaf& leaf, const SplitCandidate& split);

  double threshold(const BinnedLeaf& leaf, const SplitCandidate& split, const Node& node, const Node& left,
                   const Node& right) const;

 private:
  const GrowthData& data_;
  BinnedRows rows_;
  Eigen::Index memory_left_;  // for histograms of leaves that wait, in doubles
};

}  // namespace llmt
