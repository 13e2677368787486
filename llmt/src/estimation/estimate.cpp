#include "estimation/estimate.hpp"

#include <algorithm>
#include <cmath>

#include "constraints/ordered_splits.hpp"
#include "estimation/joint_fit.hpp"
#include "model/evaluator.hpp"

namespace llmt {
namespace {

// Leaves of the tree that are asked whether they agree on a slope beyond the training extent.
constexpr Eigen::Index leaves_that_agree = 32;

// From a sample with so many rows for each unknown the joint estimate on many more rows starts.
constexpr Eigen::Index rows_per_unknown = 50;

}  // namespace

Eigen::MatrixXd agreed_slope(const Partition& grown) {
  const Partition first = prefix(grown, leaves_that_agree);
  const Node& root = first.nodes.front();
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(root.slope.rows(), root.slope.cols());
  for (const Node& node : first.nodes) {
    if (node.is_leaf()) {
      spread +=
          static_cast<double>(node.samples) / static_cast<double>(root.samples) * (node.slope - root.slope).cwiseAbs2();
    }
  }
  Eigen::MatrixXd slope = root.slope;
  for (Eigen::Index o = 0; o < spread.rows(); ++o) {
    for (Eigen::Index k = 0; k < spread.cols(); ++k) {
      const double squared = root.slope(o, k) * root.slope(o, k);
      slope(o, k) *= squared > spread(o, k) ? 1.0 - spread(o, k) / squared : 0.0;
    }
  }
  return slope;
}

Partition blended(const TrainingRows& training, const GrownTree& grown, const Validity& validity, double jump) {
  Partition partition = grown.partition;
  partition.validity = validity;
  set_half_widths(partition, training.low(), training.high());
  limit_half_widths(partition, training);
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    if (grown.jumps(i) >= jump) {
      partition.nodes[i].half_width = 0.0;
    }
  }
  return partition;
}

Partition estimate(const TrainingRows& training, const GrownTree& grown, const Candidate& candidate, int max_threads) {
  Partition partition = prefix(blended(training, grown, candidate.validity, candidate.jump), candidate.leaves);
  if (candidate.leaves == 1) {
    partition.outer_slope.resize(0, 0);  // one linear model goes on as it is
  }
  if (candidate.validity.kind == ValidityKind::crisp) {
    const JointFit fit(training, std::move(partition), max_threads, candidate.sparse);
    return candidate.sparse || candidate.shrinkage > 0.0
               ? fit.local(candidate.leaves, candidate.shrinkage, candidate.sparse)
               : fit.as_grown(candidate.leaves);
  }
  const Regularisation regularisation{candidate.ridge, candidate.shrinkage, candidate.sparse};
  const Eigen::Index enough = rows_per_unknown * candidate.leaves * (std::ssize(training.regressors) + 1);
  if (candidate.estimation == Estimation::joint && training.count() > 2 * enough) {
    const TrainingRows sample = thinned(training, enough);
    const JointFit fit(sample, std::move(partition), max_threads, candidate.sparse);
    return fit.joint_on(training, candidate.leaves, regularisation);
  }
  const JointFit fit(training, std::move(partition), max_threads, candidate.sparse);
  switch (candidate.estimation) {
    case Estimation::as_grown:
      return fit.as_grown(candidate.leaves);
    case Estimation::local:
      return fit.local(candidate.leaves, candidate.shrinkage, candidate.sparse);
    case Estimation::joint:
      break;
  }
  return std::move(fit.joint(candidate.leaves, {regularisation}).front());
}

Eigen::VectorXd prefix_squared_errors(const Partition& partition, const TrainingRows& rows,
                                      const Eigen::VectorXd& weights, int max_threads) {
  const Evaluator evaluator(partition, rows.columns, std::ssize(rows.regressors));
  // Of the sum, from M - 1 to M leaves.
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

double squared_error(const Partition& partition, const TrainingRows& columns, const std::vector<Chunk>& rows,
                     const Eigen::VectorXd& weights) {
  const Evaluator evaluator(partition, columns.columns, std::ssize(columns.regressors));
  std::vector<Activation> active;
  Eigen::VectorXd values(std::ssize(partition.outputs));
  double sum = 0.0;
  for (const Chunk& chunk : rows) {
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      evaluator.activate(chunk.inputs.row(row).data(), active);
      evaluator.combine(active, chunk.deviations.row(row).data(), values.data());
      sum += chunk.weights(row) * weights.dot((chunk.outputs.row(row).transpose() - values).cwiseAbs2());
    }
  }
  return sum;
}

}  // namespace llmt
