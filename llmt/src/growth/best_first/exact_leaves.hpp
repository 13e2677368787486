/// \file
/// Leaves of a growing tree whose rows are sorted by every numeric split input. By the rule RA they are not sorted.
#pragma once

#include <array>
#include <vector>

#include "growth/best_first/exact_leaf.hpp"
#include "growth/search/split_search.hpp"

namespace llmt {

class ExactLeaves {
 public:
  explicit ExactLeaves(const GrowthData& data) : data_(data) {}

  /// A leaf of the given training rows, with the residuals of the parent's model there.
  ExactLeaf open(const std::vector<int>& rows, const Node& parent) const;

  /// Fits the leaf's local model as a correction of its parent's, which fills in `node`, and searches all split inputs:
  /// the best split, acceptable or not.
  SplitCandidate examine(ExactLeaf& leaf, const Node& parent, Node& node) const;

  struct Children {
    std::array<ExactLeaf, 2> leaves;
    double missing_left = 0.0;  ///< see Node::missing_left
  };

  /// Divides the rows of a leaf with the local model `node`. All orders stay sorted.
  Children divide(const ExactLeaf& leaf, const Node& node, const SplitCandidate& split) const;

  /// Node::threshold of a split on a number (docs/algorithms/growth.md, G.6), given the models of node and children.
  double threshold(const ExactLeaf& leaf, const SplitCandidate& split, const Node& node, const Node& left,
                   const Node& right) const;

 private:
  bool by_residuals() const { return data_.problem.criterion == SplitCriterion::residual_signs; }
  std::vector<int> sorted_rows(const ExactLeaf& leaf, Eigen::Index split_input) const;

  const GrowthData& data_;
};

}  // namespace llmt
