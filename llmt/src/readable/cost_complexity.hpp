/// \file
/// Cost-complexity pruning (Breiman et al. 1984, ch. 3) of a tree whose leaves have equations of several lengths.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt {

/// A node before it is decided whether it stays a split.
struct PricedNode {
  int left = -1;  ///< -1: it cannot be split. Children stand behind their parents
  int right = -1;
  Eigen::Index split_size = 0;           ///< what its split adds to the size of the expression
  std::vector<double> errors;            ///< as a leaf, with the shortest equation, the second, ...
  std::vector<Eigen::Index> sizes = {};  ///< of these equations
};

/// Stands in the place of an equation for a node that is no leaf.
inline constexpr int stays_split = -1;

/// The tree that minimises (A.1), sum of errors + price x size. For every node the equation that it has as a leaf, or
/// stays_split; of equal costs the smaller tree, and the shorter equation. Nodes below a leaf have the entry that they
/// would have if there were a split above them.
std::vector<int> cheapest_tree(const std::vector<PricedNode>& nodes, double price);

/// The nodes of a pruned tree that belong to it, in the order of their numbers.
std::vector<int> nodes_of(const std::vector<PricedNode>& nodes, const std::vector<int>& pruned);

}  // namespace llmt
