/// \file
/// Leaves that touch share a local model where that costs little.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "estimation/normal_equations.hpp"
#include "llmt/model.hpp"

namespace llmt {

/// Two groups of leaves, each named by its first one in order of growth, become one; kept < merged.
struct Merge {
  int kept = 0;
  int merged = 0;
  double rise = 0.0;  ///< of the weighted residual sum of squares
};

/// Pairs of leaves whose boxes share a face, positions in `leaves` (nodes), first < second, ascending. Two sets of
/// levels touch whatever the levels, and so do rows with and without a value.
std::vector<std::pair<int, int>> touching_leaves(const Partition& partition, const std::vector<int>& leaves);

/// Greedy agglomeration of the leaves to a single group, all of which no merge has made share a model before: of all
/// groups that touch, the two are merged next for which one local model instead of two raises the residual sum of
/// squares least, rows weighted by validity,
///   rise = (w_1 - w)' G_1 (w_1 - w) + (w_2 - w)' G_2 (w_2 - w),  w of both together,
/// added up over the outputs with `weights`. It needs no pass over rows, for G and the products b of two leaves
/// together are sums. Equal rises: the older leaves.
std::vector<Merge> merge_sequence(const Partition& partition, const NormalEquations& sums,
                                  const Eigen::VectorXd& weights);

/// Coefficients that rows with this Gram matrix of [1, x] determine: directions below 1e-10 of the largest variance, in
/// columns of unit variance, count as collinear.
int rank_of(const Eigen::MatrixXd& gram);

}  // namespace llmt
