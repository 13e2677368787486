/// \file
/// The tree of a partition and the boxes that it cuts.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

/// Undoes the split of a node.
void make_leaf(Node& node);

/// Parent of every node, -1 for the root.
std::vector<int> parents_of(const Partition& partition);

/// The node whose slopes take over beyond the range of each node, -1 for the root: see Node::guard_parent.
std::vector<int> guard_parents_of(const Partition& partition);

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
