/// \file
/// Leaves of a growing tree whose rows are sorted by every input: exact search for their best split. By the rule RA
/// they are not sorted, and split by the signs of their residuals.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "growth/growth_data.hpp"
#include "growth/search/split_search.hpp"
#include "numerics/node_fit.hpp"

namespace llmt {

struct ExactLeaf {
  RowMajor inputs;                       ///< of the rows, all columns
  Eigen::VectorXd weights;               ///< of the rows here
  std::vector<std::vector<int>> orders;  ///< rows by each numeric split input that has a value, ascending; RA: empty
  Eigen::MatrixXd residuals;  ///< of a local model, rows x outputs: the parent's until examined, then its own
};

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

  /// Splits a leaf of local model `node`.
  Children divide(const ExactLeaf& leaf, const Node& node, const SplitCandidate& split) const;

  /// Where the threshold of a split on a number lies, given the children's models.
  double threshold(const ExactLeaf& leaf, const SplitCandidate& split, const Node& node, const Node& left,
                   const Node& right) const;

 private:
  /// Where a row of a leaf goes.
  enum class Side : signed char { left, right, both };

  double split_value(const ExactLeaf& leaf, Eigen::Index row, Eigen::Index split_input) const;
  RowMajor deviations(const ExactLeaf& leaf) const;
  Eigen::MatrixXd about_own_mean(const RowMajor& deviations, const Node& parent, Eigen::MatrixXd residuals,
                                 const Eigen::VectorXd& weights) const;
  std::vector<int> levels_of(const ExactLeaf& leaf, Eigen::Index split_input) const;
  bool by_signs() const { return data_.problem.options.rule == GrowthRule::ra; }
  SplitCandidate find_split(const ExactLeaf& leaf, const NodeFit& fit, double rss) const;
  SplitCandidate find_split_by_signs(const ExactLeaf& leaf, const SearchNode& node, int rank) const;
  void consider_missing(const SearchNode& node, const ExactLeaf& leaf, Eigen::Index split_input,
                        SplitCandidate& best) const;
  std::vector<Side> sides_of(const ExactLeaf& leaf, const SplitCandidate& split) const;
  double learn_missing_left(const ExactLeaf& leaf, const Node& parent, const std::vector<Side>& sides) const;

  const GrowthData& data_;
};

}  // namespace llmt
