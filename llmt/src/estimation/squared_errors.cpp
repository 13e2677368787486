#include "estimation/squared_errors.hpp"

#include <algorithm>

#include "partition/evaluator.hpp"
#include "partition/tree.hpp"

namespace llmt {
namespace {

// `below` under `matrix`.
void append(Eigen::MatrixXd& matrix, const Eigen::MatrixXd& below) {
  const Eigen::Index rows = matrix.rows();
  matrix.conservativeResize(rows + below.rows(), below.cols());
  matrix.bottomRows(below.rows()) = below;
}

// The partition whose outputs are those of the first of `partitions`, then those of the second, and so on.
Partition side_by_side(const std::vector<Partition>& partitions) {
  Partition result = partitions.front();
  for (auto other = partitions.begin() + 1; other != partitions.end(); ++other) {
    result.outputs.insert(result.outputs.end(), other->outputs.begin(), other->outputs.end());
    for (std::size_t i = 0; i < result.nodes.size(); ++i) {
      Node& node = result.nodes[i];
      const Node& more = other->nodes[i];
      node.value.conservativeResize(node.value.size() + more.value.size());
      node.value.tail(more.value.size()) = more.value;
      append(node.slope, more.slope);
    }
    append(result.residual_range, other->residual_range);
    append(result.outer_slope, other->outer_slope);
    append(result.output_range, other->output_range);
  }
  return result;
}

}  // namespace

Eigen::VectorXd prefix_squared_errors(const Partition& partition, const Partition& grown, const TrainingRows& rows,
                                      const Eigen::VectorXd& weights, int max_threads) {
  const Evaluator evaluator(partition, rows.columns, std::ssize(rows.regressors));
  // Outer slopes of the trees with 1, 2, ... leaves; larger trees have that of the last.
  std::vector<Eigen::MatrixXd> outer_slopes = {partition.nodes.front().slope};
  for (Eigen::Index leaves = 2; leaves <= std::min(leaves_that_agree, partition.num_leaves()); ++leaves) {
    outer_slopes.push_back(agreed_slope(grown, leaves));
  }
  // By how much the sum changes from M - 1 to M leaves.
  Eigen::VectorXd zero = Eigen::VectorXd::Zero(partition.num_leaves());
  const auto add = [&](const Chunk& chunk, Eigen::VectorXd& changes) {
    Eigen::VectorXd values(std::ssize(partition.outputs));
    Eigen::VectorXd beyond(std::ssize(rows.regressors));
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      const double* deviations = chunk.deviations.row(row).data();
      double previous = 0.0;
      const auto change = [&](Eigen::Index place, const auto& prediction) {
        const double squared =
            chunk.weights(row) * weights.dot((chunk.outputs.row(row).transpose() - prediction).cwiseAbs2());
        changes(place) += squared - previous;
        previous = squared;
      };
      // Nodes 2k-1 and 2k come with the k-th split, that is with k + 1 leaves.
      for (int node = 0; node >= 0;) {
        const int next = partition.nodes[node].is_leaf() ? -1 : evaluator.child_of(node, chunk.inputs.row(row).data());
        evaluator.local(node, deviations, values.data());
        Eigen::Index place = (node + 1) / 2;
        if (evaluator.hold(deviations, values.data())) {
          change(place, values);
        } else {
          // Every further leaf changes the outer slope too, until the slopes of enough leaves agree.
          evaluator.beyond(deviations, beyond.data());
          const Eigen::Index last = std::ssize(outer_slopes) - 1;
          change(place, values + outer_slopes[std::min(place, last)] * beyond);
          const Eigen::Index end = next < 0 ? last + 1 : std::min<Eigen::Index>(last + 1, (next + 1) / 2);
          for (++place; place < end; ++place) change(place, values + outer_slopes[place] * beyond);
        }
        node = next;
      }
    }
  };
  Eigen::VectorXd sums = sum_over(rows, partition.outputs, max_threads, std::move(zero), add);
  for (Eigen::Index leaves = 1; leaves < sums.size(); ++leaves) {
    sums(leaves) += sums(leaves - 1);
  }
  return sums.cwiseMax(0.0);
}

std::vector<Eigen::VectorXd> squared_errors(const std::vector<Partition>& partitions, const TrainingRows& columns,
                                            const std::vector<Chunk>& rows, const Eigen::VectorXd& weights) {
  const Evaluator evaluator(side_by_side(partitions), columns.columns, std::ssize(columns.regressors));
  const Eigen::Index outputs = std::ssize(partitions.front().outputs);
  std::vector<Activation> active;
  Eigen::VectorXd values(std::ssize(partitions) * outputs);
  Eigen::Index count = 0;
  for (const Chunk& chunk : rows) count += chunk.count();
  Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(error_parts, std::ssize(partitions));
  const auto add = [&](RowSpan block, Eigen::MatrixXd& sums) {
    const Chunk& chunk = rows[block.begin];
    const Eigen::Index before = block.begin * rows.front().count();
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      evaluator.activate(chunk.inputs.row(row).data(), active);
      evaluator.combine(active, chunk.deviations.row(row).data(), values.data());
      for (std::size_t k = 0; k < partitions.size(); ++k) {
        const auto of_partition = values.segment(static_cast<Eigen::Index>(k) * outputs, outputs);
        sums((before + row) * error_parts / count, k) +=
            chunk.weights(row) * weights.dot((chunk.outputs.row(row).transpose() - of_partition).cwiseAbs2());
      }
    }
  };
  // Each chunk is a block.
  const Eigen::MatrixXd sums = sum_over(RowBlocks{std::ssize(rows), 1}, 1, std::move(zero), add);
  return {sums.colwise().begin(), sums.colwise().end()};
}

Eigen::VectorXd squared_errors(const Partition& partition, const TrainingRows& columns, const std::vector<Chunk>& rows,
                               const Eigen::VectorXd& weights) {
  return squared_errors(std::vector{partition}, columns, rows, weights).front();
}

}  // namespace llmt
