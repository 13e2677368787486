/// \file
/// The exhaustive search for the split of a node whose two least-squares models leave the least.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "node_fit.hpp"

namespace llmt {

/// The best split of a node found so far, or none.
struct SplitCandidate {
  int input = -1;           ///< column that is split; -1: there is no admissible split
  std::ptrdiff_t left = 0;  ///< rows of the left child: the first `left` in the order of that input
  double rss = 0.0;         ///< weighted residual sum of squares of the two child models
  int rank_left = 0;        ///< ranks of the two children's least-squares problems
  int rank_right = 0;
  std::ptrdiff_t tested = 0;    ///< number of admissible splits that were compared
  bool by_missing = false;      ///< rows with a value go left, rows without one right
  std::vector<int> level_side;  ///< categorical input: -1 left, 1 right, 0 not seen, one per level
};

/// What the search of a node needs to know of its rows.
struct SearchNode {
  /// rows x (rank + outputs), one row after the other in memory: the constant, the orthogonalised regressors and the
  /// residuals of the node's fit, all times the square root of the row's weight.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> features;
  std::ptrdiff_t regressors = 0;  ///< rank - 1
  Eigen::VectorXd weights;        ///< of the outputs' residual sums of squares
  double rss = 0.0;               ///< weighted, of the node's own model
};

SearchNode make_search_node(const NodeFit& fit, const Eigen::VectorXd& weights);

/// The best split on one input: `values` are the input's values and `order` the rows of `node.features`, both ascending
/// in the value.
///
/// Compares every split between two distinct values that leaves `min_leaf_samples` rows on either side. The sums of
/// each side are only ever added to, from the left and from the right, never subtracted from: no digits are lost at the
/// ends. Rows without a value take part in neither side; the gain of the others is what counts. Of splits that agree
/// within `tie_tolerance` times node.rss, the one with the smallest threshold is taken. `input` stays -1 if nothing is
/// admissible.
SplitCandidate search_input(const SearchNode& node, std::span<const double> values, std::span<const int> order,
                            std::ptrdiff_t min_leaf_samples);

/// The best split on a categorical input: `levels` has the level of each row of `node.features`, or -1.
///
/// Tries the levels in ascending order of the mean of the residuals, and of the residuals times each regressor, split
/// between any two: all splits for two levels, all that matter for one-dimensional scores (Fisher 1958) for more.
SplitCandidate search_levels(const SearchNode& node, std::span<const int> levels, int num_levels,
                             std::ptrdiff_t min_leaf_samples);

/// Rounding differs with the order of rows and with columns that carry no information; ties must not depend on it.
inline constexpr double tie_tolerance = 1e-10;

}  // namespace llmt
