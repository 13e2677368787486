/// \file
/// The tree of the sample, whose splits are as fit() finds them in the sample and whose local models are fitted to all
/// rows together (docs/algorithms/distributed.md, "The tree of the sample").
#pragma once

#include <Eigen/Core>
#include <tuple>
#include <vector>

#include "base/sums.hpp"
#include "distributed/block.hpp"
#include "distributed/state.hpp"
#include "llmt/progress.hpp"

namespace llmt::distributed {

/// Sums over rows for the local models of the sample's tree. Unknowns: of each leaf a constant and a slope for every
/// regressor, leaf after leaf; the last row and column of a matrix are those of the residual of the sample's model.
struct JointSums {
  Eigen::MatrixXd gram;                 ///< (unknowns + 1)^2, the lower triangle; over all rows
  std::vector<Eigen::Index> leaf_rows;  ///< in the box of each leaf
  std::vector<double> leaf_squares;     ///< weighted squares of the residuals of the sample's model there
  double tree_squares = 0.0;            ///< the same of the model of top and branches, over all rows
  Extent root_residual;                 ///< of the root of the sample's tree

  static auto fields(auto& self) {
    return std::tie(self.gram, self.leaf_rows, self.leaf_squares, self.tree_squares, self.root_residual);
  }
};

/// Fits the sample's tree, unless it has too many leaves for its equations to be summed.
void take_sample(StateData& data, const Sample& sample, const Progress& progress, int max_threads);

/// The sums of a block.
void add_joint(const StateData& data, const Block& block, JointSums& sums);

/// Fits the local models, and takes the tree in place of top and branches if it predicts better.
void take_joint(StateData& data, JointSums sums);

}  // namespace llmt::distributed
