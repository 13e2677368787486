#include "estimation/constrained_estimate.hpp"

#include <Eigen/Cholesky>

#include "constraints/monotone_splits.hpp"

namespace llmt {

Partition constrained(const LeafSums& sums, const std::vector<int>& leaf_nodes, const FreeEstimate& free,
                      ActiveInequalities& active) {
  const Eigen::Index leaves = std::ssize(leaf_nodes);
  Partition result = with_models(sums, leaves, free.models, free.sparse);
  Eigen::MatrixXd coefficients = free.leaf_coefficients;
  if (!sums.signs.empty()) {
    constrain_leaves(result, *sums.training, leaf_nodes, free.factor, sums.root, coefficients, active);
  }
  for (Eigen::Index k = 0; k < leaves; ++k) {
    set_model(sums, coefficients.middleRows(k * sums.size(), sums.size()), result.nodes[leaf_nodes[k]]);
  }
  finish_constrained(result, *sums.training);
  return result;
}

Partition constrained_one_by_one(const LeafSums& sums, Eigen::Index leaves, const std::vector<Eigen::MatrixXd>& models,
                                 double shrinkage) {
  Partition result = with_models(sums, leaves, models, false);
  if (!has_ordered_splits(result, *sums.training)) {
    finish_constrained(result, *sums.training);
    return result;
  }
  const Eigen::Index size = sums.size();
  std::vector<int> leaf_nodes;
  FreeEstimate free;
  free.models = models;
  free.leaf_coefficients.resize(leaves * size, sums.root.cols());
  free.factor.setZero(leaves * size, leaves * size);
  for (int node = 0; node < std::ssize(result.nodes); ++node) {
    if (!result.nodes[node].is_leaf()) continue;
    const Eigen::Index at = std::ssize(leaf_nodes) * size;
    leaf_nodes.push_back(node);
    free.leaf_coefficients.middleRows(at, size) = models[node];
    Eigen::MatrixXd matrix = sums.equations.gram[node];
    matrix.diagonal() += shrinkage_diagonal(sums, node, shrinkage);
    free.factor.block(at, at, size, size) = matrix.llt().matrixU();
  }
  ActiveInequalities none;
  return constrained(sums, leaf_nodes, free, none);
}

}  // namespace llmt
