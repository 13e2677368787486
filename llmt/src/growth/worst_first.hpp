/// \file
/// Growth that splits the worst local model in each step: LOLIMOT and HILOMOT.
#pragma once

#include <Eigen/Core>

#include "llmt/summary.hpp"

namespace llmt {

/// A weighted sum of squared errors below this, per output, is rounding, for the outputs' sums of squares are 1. AICc,
/// which takes the logarithm of the error, does not go below it.
inline constexpr double least_loss = 1e-24;

/// How growth ended.
struct GrowthEnd {
  StopReason stop = StopReason::leaf_samples;
  Eigen::Index leaves = 1;  ///< number of first leaves that stay
};

/// Splits the worst local model of `tree` until there are `max_leaves` leaves (0: no limit), the tree is exact, or no
/// local model can be split. With `by_aicc` growth also ends when ten further leaves did not lower the corrected Akaike
/// criterion (docs/algorithms/lolimot.md, L.1), and the number of leaves with the smallest criterion stays.
///
/// `Tree` has num_leaves(), is_exact(), aicc(), and split_worst(), which returns false if nothing can be split.
template <class Tree>
GrowthEnd split_worst_first(Tree& tree, Eigen::Index max_leaves, bool by_aicc) {
  constexpr Eigen::Index patience = 10;  // leaves
  double smallest = by_aicc ? tree.aicc() : 0.0;
  Eigen::Index best = tree.num_leaves();
  StopReason stop = StopReason::leaf_samples;
  while (true) {
    if (max_leaves > 0 && tree.num_leaves() >= max_leaves) {
      stop = StopReason::max_leaves;
      break;
    }
    if (tree.is_exact()) {
      stop = StopReason::exact_fit;
      break;
    }
    if (!tree.split_worst()) break;
    if (!by_aicc) continue;
    if (const double criterion = tree.aicc(); criterion < smallest) {
      smallest = criterion;
      best = tree.num_leaves();
    } else if (tree.num_leaves() >= best + patience) {
      break;
    }
  }
  if (by_aicc && best < tree.num_leaves()) return {StopReason::aicc, best};
  return {stop, tree.num_leaves()};
}

}  // namespace llmt
