#include "estimation/sums/missing_by_validity.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "partition/tree.hpp"

namespace llmt {
namespace {

// Only a blend has gates on which thresholds lie anywhere within.
bool has_gate(const Partition& partition, const Node& node) {
  return partition.validity.kind == ValidityKind::blend && !node.is_leaf() && node.level_side.empty();
}

// Sums over rows, one column or entry for each node. The validity of an inner node is that of the leaves below it.
struct Present {
  Eigen::MatrixXd sums;      // of the regressors, over the rows that have them, weighted by validity
  Eigen::MatrixXd weights;   // the same of 1
  Eigen::VectorXd validity;  // of the weighted validities
  Eigen::VectorXd in_box;    // of the weights of the rows in the node's box

  static auto fields(auto& self) { return std::tie(self.sums, self.weights, self.validity, self.in_box); }
};

Present add_up(const TrainingRows& training, const Evaluator& evaluator, bool leave_out, const Partition& partition,
               int max_threads) {
  const Eigen::Index regressors = std::ssize(training.regressors);
  const Eigen::Index nodes = std::ssize(partition.nodes);
  Present zero{Eigen::MatrixXd::Zero(regressors, nodes), Eigen::MatrixXd::Zero(regressors, nodes),
               Eigen::VectorXd::Zero(nodes), Eigen::VectorXd::Zero(nodes)};
  const auto add = [&](const Chunk& chunk, Present& present) {
    std::vector<Activation> active;
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      const double* inputs = chunk.inputs.row(row).data();
      if (leave_out && evaluator.is_ambiguous(inputs)) continue;
      evaluator.activate(inputs, active);
      for (const Activation& entry : active) {
        const double weight = chunk.weights(row) * entry.validity;
        present.validity(entry.node) += weight;
        for (Eigen::Index k = 0; k < regressors; ++k) {
          if (std::isnan(chunk.deviations(row, k))) continue;
          present.sums(k, entry.node) += weight * chunk.deviations(row, k);
          present.weights(k, entry.node) += weight;
        }
      }
      int node = 0;
      while (!partition.nodes[node].is_leaf()) node = evaluator.child_of(node, inputs);
      present.in_box(node) += chunk.weights(row);
    }
  };
  Present present = sum_over(training, {}, max_threads, std::move(zero), add);
  const std::vector<int> parents = parents_of(partition);
  for (Eigen::Index node = nodes - 1; node > 0; --node) {
    present.validity(parents[node]) += present.validity(node);
    present.in_box(parents[node]) += present.in_box(node);
    present.sums.col(parents[node]) += present.sums.col(node);
    present.weights.col(parents[node]) += present.weights.col(node);
  }
  return present;
}

}  // namespace

void describe_missing_by_validity(const TrainingRows& training, const Evaluator& evaluator, bool leave_out,
                                  Partition& partition, int max_threads) {
  const Present present = add_up(training, evaluator, leave_out, partition, max_threads);
  for (Eigen::Index i = 0; i < std::ssize(partition.nodes); ++i) {
    Node& node = partition.nodes[i];
    if (i > 0) {
      const auto weight = present.weights.col(i).array();
      node.mean = (weight > 0.0).select(present.sums.col(i).array() / weight, node.mean.array());
    }
    if (has_gate(partition, node) && present.in_box(i) > 0.0 && present.validity(i) > 0.0) {
      const double by_validity = present.validity(node.left) / present.validity(i);
      const double by_rows = present.in_box(node.left) / present.in_box(i);
      node.missing_left = std::clamp(node.missing_left + by_validity - by_rows, 0.0, 1.0);
    }
  }
}

void describe_missing_by_sums(const NormalEquations& sums, const Eigen::VectorXd& scale, Partition& partition) {
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    Node& node = partition.nodes[i];
    const double weight = sums.gram[i](0, 0);
    if (!(weight > 0.0)) continue;
    if (i > 0) node.mean = scale.cwiseProduct(sums.gram[i].col(0).tail(scale.size())) / weight;
    if (has_gate(partition, node)) {
      node.missing_left = std::clamp(sums.gram[node.left](0, 0) / weight, 0.0, 1.0);
    }
  }
}

}  // namespace llmt
