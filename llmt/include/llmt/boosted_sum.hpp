/// \file
/// The parts of a boosted model as plain data: features, trees, and their sum.
#pragma once

#include <vector>

#include "llmt/limits.hpp"
#include "llmt/spread.hpp"

namespace llmt {

/// A number of each row. Trees split on it, and leaves take it as a regressor. It is a standardised input
/// z = (x - centre) / deviation, the sum of several with factors, sum_k factors_k z_k, or the indicator (0 or 1) of a
/// level of a categorical input. A row that lacks one of the inputs lacks the feature.
struct BoostedFeature {
  std::vector<int> inputs = {0};        ///< indices; a level has one
  std::vector<double> factors = {1.0};  ///< one for each of `inputs`
  int level = -1;                       ///< index of the level; -1: the feature is a number

  bool operator==(const BoostedFeature&) const = default;
};

/// The largest number of slopes in a leaf of a tree that boosting grew.
inline constexpr int most_boosted_slopes = 8;
/// The largest number of slopes in a leaf of any tree. The time of contributions of inputs may double with each.
inline constexpr int most_leaf_slopes = most(Limit::sum_leaf_slopes);

/// f = constant + sum of slopes . features, held to [low, high]. A feature that a row lacks counts as its mean.
struct BoostedLeaf {
  double constant = 0.0;
  double low = 0.0;
  double high = 0.0;
  std::vector<int> features = {};   ///< indices into BoostedSum::features
  std::vector<double> slopes = {};  ///< one for each of `features`
  /// Stand in for features that a row lacks, one for each of `features`: the mean in the leaf's rows, or 0, as in the
  /// fit, where some rows of the fit lacked the feature. Empty: all 0.
  std::vector<double> means = {};
};

/// z <= threshold of a feature goes to the left. With a half width h > 0 the rows with |z - threshold| < h go to both
/// sides, to the right with the weight 1/2 + u (3 - u^2) / 4, u = (z - threshold) / h, unless one side would get less
/// of the row than BoostedTree::smallest_share: then the side on which it lies takes all.
struct BoostedSplit {
  int feature = 0;          ///< index into BoostedSum::features
  double threshold = 0.0;   ///< in the unit of the feature
  double half_width = 0.0;  ///< in the unit of the feature; 0: a crisp split
  /// The share of a row without the feature that goes to the left. 0 or 1: the side on which such rows of the fit are
  /// best. Where the fit had none, the left side's part of the weight of the rows.
  double missing_left = 0.0;
  int left = 0;   ///< index of a split below this one; or -1 - k: leaf k
  int right = 0;  ///< as `left`
};

/// One tree; the first split is the root. Without splits there is one leaf.
struct BoostedTree {
  std::vector<BoostedSplit> splits;
  std::vector<BoostedLeaf> leaves;
  double smallest_share = 0.08;  ///< of a row on one side of a split, from 0 to 0.5; see BoostedSplit
};

/// Absolute residuals of a part of the held-out rows under trees that were fitted without them, each divided by the
/// spread at its row, which was learnt from the other parts.
struct SumResiduals {
  std::vector<double> residuals;  ///< ascending
  Spread spread = {};
};

/// The trees of one output: y = base + rate . sum of trees.
struct BoostedSum {
  double base = 0.0;  ///< in the unit of the output
  double rate = 1.0;
  std::vector<BoostedFeature> features;
  std::vector<BoostedTree> trees;
  std::vector<SumResiduals> held_out = {};  ///< for intervals; empty: there are none
};

}  // namespace llmt
