// Estimates of leaves one by one under signs of slopes and ordered splits.
#include <Eigen/Cholesky>

#include "constraints/ordered_splits.hpp"
#include "estimation/joint_fit.hpp"

namespace llmt {

bool JointFit::has_ordered_leaves() const { return has_ordered_splits(partition_, training_); }

Partition JointFit::constrained(Eigen::Index leaves, std::vector<Eigen::MatrixXd> models, double shrinkage) const {
  Partition result = with_models(leaves, models, false);
  if (!has_ordered_splits(result, training_)) {
    finish_constrained(result, training_);
    return result;
  }
  System blocks;  // of the leaves alone
  blocks.leaves = leaves;
  for (std::size_t i = 0; i < result.nodes.size(); ++i) {
    if (result.nodes[i].is_leaf()) {
      blocks.nodes.push_back(static_cast<int>(i));
    }
  }
  Solution solution;
  solution.coefficients.resize(leaves * size_, root_.cols());
  solution.factor.setZero(leaves * size_, leaves * size_);
  for (std::size_t k = 0; k < blocks.nodes.size(); ++k) {
    const std::size_t node = blocks.nodes[k];
    const Eigen::Index at = static_cast<Eigen::Index>(k) * size_;
    solution.coefficients.middleRows(at, size_) = models[node];
    Eigen::MatrixXd matrix = sums_.gram[node];
    matrix.diagonal() += hold(node, shrinkage);
    solution.factor.block(at, at, size_, size_) = matrix.llt().matrixU();
  }
  solution.local = std::move(models);
  ActiveInequalities none;
  return with_solution(blocks, solution, none);
}

}  // namespace llmt
