/// \file
/// The tree of a partition and the boxes that it cuts.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/partition.hpp"

namespace llmt {

/// Undoes the split of a node.
void make_leaf(Node& node);

/// The slopes with which the tree of the first `leaves` leaves of a grown tree goes on beyond the training extent,
/// eq. (B.4) of docs/algorithms/guards.md: the root's slopes, shrunk by the mean square spread of the slopes of those
/// leaves, but of no more than the first 32, about them, as in a James-Stein estimate. Outputs x regressors.
Eigen::MatrixXd agreed_slope(const Partition& grown, Eigen::Index leaves);

/// The number of leaves from which on agreed_slope() stays the same.
inline constexpr Eigen::Index leaves_that_agree = 32;

/// The tree of the first `leaves` leaves of a grown tree, with an outer slope of its own: what it predicts does not
/// depend on how large the tree was grown. One leaf goes on with the slopes that it will have: the outer slope is
/// empty.
Partition grown_prefix(const Partition& grown, Eigen::Index leaves);

/// Parent of every node, -1 for the root.
std::vector<int> parents_of(const Partition& partition);

/// The guard of a leaf asks this many ancestors, and then the root: a bound on the time that a leaf takes in a tree of
/// any depth (docs/algorithms/guards.md, B.2).
inline constexpr int most_ancestors = 64;

/// The ancestor that the guard asks after `at`, -1 after the root. `left`: how many may be asked before the root is;
/// most_ancestors at the leaf.
inline int next_ancestor(const std::vector<int>& parents, int at, int& left) {
  const int parent = parents[at];
  if (parent <= 0) return parent;
  return --left < 0 ? 0 : parent;
}

/// Boxes of all nodes, inputs x nodes each, cut out of low ... high by the axis-orthogonal splits on numbers.
struct Boxes {
  Eigen::MatrixXd low;
  Eigen::MatrixXd high;
};
Boxes boxes_of(const Partition& partition, const Eigen::VectorXd& low, const Eigen::VectorXd& high);

/// Sets Node::half_width of a partition for its validity: the boxes are closed by `low` and `high`, one per input.
/// Logistic gates: what the nodes have is what growth left there.
void set_half_widths(Partition& partition, const Eigen::VectorXd& low, const Eigen::VectorXd& high);

}  // namespace llmt
