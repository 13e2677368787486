/// \file
/// The split of a node of the top of the tree, from the sums of its bins.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "distributed/block_sums.hpp"
#include "distributed/state.hpp"

namespace llmt::distributed {

/// A split of the bins of an input into two sides.
struct TopSplit {
  Eigen::Index input = -1;  ///< -1: none
  double adjusted = std::numeric_limits<double>::infinity();
  Eigen::Index edge = 0;                 ///< number: place of the threshold among the input's edges
  std::vector<Eigen::Index> level_side;  ///< category: of each level -1 left, 1 right, 0 no row
  Eigen::Index left_rows = 0;
  double left_weight = 0.0;
};

/// The split with the smallest adjusted RSS (G.7) among those that leave an eighth of the node's weight on either side,
/// or the part of the most even one where there is none. Numbers are split at an edge between two bins; levels of a
/// category stand in the order of their mean residuals of the node's model, which is base + `change`. `node.gram` and
/// `node.rows` are known.
TopSplit best_split(const StateData& data, const NodeSums& sums, const TopNode& node, const Eigen::VectorXd& change,
                    int rank);

}  // namespace llmt::distributed
