/// \file
/// Large leaves of a growing tree that are split by the signs of their residuals.
#pragma once

#include <array>
#include <vector>

#include "growth/best_first/residual_search.hpp"
#include "growth/best_first/whitened_rows.hpp"

namespace llmt {

struct SignLeaf : WhitenedLeaf {
  Eigen::MatrixXd values;                          ///< of the split inputs in the rows, rows x split inputs
  std::vector<double> gram;                        ///< of the rows
  std::array<std::vector<double>, 2> child_grams;  ///< of both sides of the best split, if it is on a number
};

/// Residual analysis where no value is missing. The features of all rows stay in the basis of the root: a node costs a
/// pass over its features for the residuals' signs, one over the values of each input, and one for the Gram matrices of
/// its children, from which their models follow.
class SignLeaves {
 public:
  explicit SignLeaves(const GrowthData& data) : data_(data), rows_(data) {}

  SignLeaf root() const;

  /// As ExactLeaves::examine().
  SplitCandidate examine(SignLeaf& leaf, const Node& parent, Node& node);

  std::array<SignLeaf, 2> divide(SignLeaf& leaf, const SplitCandidate& split) const;

  double threshold(const SignLeaf& leaf, const SplitCandidate& split, const Node& node, const Node& left,
                   const Node& right) const;

 private:
  Eigen::MatrixXd residuals(const SignLeaf& leaf, const Node& node, int threads) const;
  SplitCandidate search_categories(const SignLeaf& leaf, Eigen::Index split_input, double node_rss) const;

  const GrowthData& data_;
  WhitenedRows rows_;
};

}  // namespace llmt
