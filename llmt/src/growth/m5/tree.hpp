/// \file
/// The tree of M5' before it is pruned, and its rows.
#pragma once

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "growth/m5/split.hpp"

namespace llmt {

/// The model of a node as it stands, before smoothing, in scaled outputs.
struct M5Model {
  Eigen::VectorXd value;
  Eigen::MatrixXd slope;         // outputs x regressors
  Eigen::VectorXd coefficients;  // their number, per output; if the subtree stays, the number in the subtree
};

struct M5Branch {
  int parent = -1;
  int left = -1;
  int right = -1;
  Eigen::Index begin = 0;  // its rows in M5Tree::rows: of the left child, of the right child, of neither child
  Eigen::Index end = 0;
  double weight = 0.0;
  DeviationSplit split;
  double missing_left = 0.5;
  std::vector<std::pair<int, double>> shared;  // rows that a child has in part, and their weights here
  std::vector<bool> tested;                    // split inputs at or below
  M5Model model;
};

struct M5Tree {
  std::vector<M5Branch> branches;  ///< children after their parents
  std::vector<int> rows;           ///< of the training rows, those of a node one after the other
  Eigen::VectorXd weights;         ///< of the training rows in the leaves that have them

  std::span<int> rows_of(const M5Branch& branch) {
    return std::span(rows).subspan(branch.begin, (branch.end - branch.begin));
  }
};

/// Splits every node that has enough rows and whose outputs deviate by at least 5 % of the standard deviation of all
/// rows (Quinlan 1992).
M5Tree grow_m5_tree(const GrowthData& data);

}  // namespace llmt
