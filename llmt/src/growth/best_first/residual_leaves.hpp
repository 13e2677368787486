/// \file
/// Large leaves of a growing tree that are split by the signs of their residuals
/// (docs/algorithms/residual-analysis.md).
#pragma once

#include <array>
#include <vector>

#include "growth/best_first/residual_search.hpp"
#include "growth/best_first/whitened_rows.hpp"

namespace llmt {

struct ResidualLeaf : WhitenedLeaf {
  Eigen::MatrixXd values;                          ///< of the split inputs in the rows, rows x split inputs
  std::vector<double> gram;                        ///< of the rows
  std::array<std::vector<double>, 2> child_grams;  ///< of both sides of the best split, if it is on a number
};

/// Residual analysis where no value is missing. The features of all rows stay in the basis of the root. A node costs
/// one pass over its features for the signs of the residuals, one pass over the values of each input, and one pass for
/// the Gram matrices of its children, from which the children's models follow.
class ResidualLeaves {
 public:
  explicit ResidualLeaves(const GrowthData& data) : data_(data), rows_(data) {}

  ResidualLeaf root() const;

  /// As ExactLeaves::examine().
  SplitCandidate examine(ResidualLeaf& leaf, const Node& parent, Node& node);

  std::array<ResidualLeaf, 2> divide(ResidualLeaf& leaf, const SplitCandidate& split) const;

  double threshold(const ResidualLeaf& leaf, const SplitCandidate& split, const Node& node, const Node& left,
                   const Node& right) const;

 private:
  Eigen::MatrixXd residuals(const ResidualLeaf& leaf, const Node& node, int threads) const;
  SplitCandidate search_categories(const ResidualLeaf& leaf, Eigen::Index split_input, const AdjustedRss& scale) const;

  const GrowthData& data_;
  WhitenedRows rows_;
};

}  // namespace llmt
