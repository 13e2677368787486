#include "selection.hpp"

namespace llmt {

Eigen::VectorXd prefix_squared_errors(const Partition& partition, const Eigen::MatrixXd& inputs,
                                      const Eigen::MatrixXd& deviations, const Eigen::MatrixXd& outputs,
                                      const Eigen::VectorXd& weights) {
  Eigen::VectorXd change = Eigen::VectorXd::Zero(partition.num_leaves());  // of the sum, from M - 1 to M leaves
  for (std::ptrdiff_t row = 0; row < inputs.rows(); ++row) {
    double previous = 0.0;
    for (std::ptrdiff_t index = 0; index >= 0;) {
      const Node& node = partition.nodes[static_cast<std::size_t>(index)];
      const Eigen::VectorXd error =
          outputs.row(row).transpose() - node.value - node.slope * deviations.row(row).transpose();
      const double squared = weights.dot(error.cwiseAbs2());
      // Nodes 2k-1 and 2k come with the k-th split, that is with k + 1 leaves.
      change((index + 1) / 2) += squared - previous;
      previous = squared;
      index = node.is_leaf() ? -1 : inputs(row, node.split_input) <= node.threshold ? node.left : node.right;
    }
  }
  for (std::ptrdiff_t leaves = 1; leaves < change.size(); ++leaves) {
    change(leaves) += change(leaves - 1);
  }
  return change.cwiseMax(0.0);
}

}  // namespace llmt
