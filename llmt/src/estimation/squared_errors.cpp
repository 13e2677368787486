#include "estimation/squared_errors.hpp"

#include "model/evaluator.hpp"

namespace llmt {

Eigen::VectorXd prefix_squared_errors(const Partition& partition, const TrainingRows& rows,
                                      const Eigen::VectorXd& weights, int max_threads) {
  const Evaluator evaluator(partition, rows.columns, std::ssize(rows.regressors));
  // By how much the sum changes from M - 1 to M leaves.
  std::vector<Eigen::VectorXd> changes(num_slots, Eigen::VectorXd::Zero(partition.num_leaves()));
  for_each_chunk(rows, partition.outputs, max_threads, [&](std::size_t slot, const Chunk& chunk) {
    Eigen::VectorXd values(std::ssize(partition.outputs));
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      const double* deviations = chunk.deviations.row(row).data();
      double previous = 0.0;
      for (int node = 0; node >= 0;) {
        evaluator.local(node, deviations, values.data());
        evaluator.finish(deviations, values.data());
        const double squared =
            chunk.weights(row) * weights.dot((chunk.outputs.row(row).transpose() - values).cwiseAbs2());
        // Nodes 2k-1 and 2k come with the k-th split, that is with k + 1 leaves.
        changes[slot]((node + 1) / 2) += squared - previous;
        previous = squared;
        node = partition.nodes[node].is_leaf() ? -1 : evaluator.child_of(node, chunk.inputs.row(row).data());
      }
    }
  });
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(partition.num_leaves());
  for (const Eigen::VectorXd& change : changes) {
    sums += change;
  }
  for (Eigen::Index leaves = 1; leaves < sums.size(); ++leaves) {
    sums(leaves) += sums(leaves - 1);
  }
  return sums.cwiseMax(0.0);
}

Eigen::VectorXd squared_errors(const Partition& partition, const TrainingRows& columns, const std::vector<Chunk>& rows,
                               const Eigen::VectorXd& weights) {
  const Evaluator evaluator(partition, columns.columns, std::ssize(columns.regressors));
  std::vector<Activation> active;
  Eigen::VectorXd values(std::ssize(partition.outputs));
  Eigen::Index count = 0;
  for (const Chunk& chunk : rows) count += chunk.count();
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(error_blocks);
  Eigen::Index before = 0;
  for (const Chunk& chunk : rows) {
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      evaluator.activate(chunk.inputs.row(row).data(), active);
      evaluator.combine(active, chunk.deviations.row(row).data(), values.data());
      sums((before + row) * error_blocks / count) +=
          chunk.weights(row) * weights.dot((chunk.outputs.row(row).transpose() - values).cwiseAbs2());
    }
    before += chunk.count();
  }
  return sums;
}

}  // namespace llmt
