#include "estimation/leaf_statistics.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "partition/evaluator.hpp"
#include "partition/imputed.hpp"

namespace llmt {
namespace {

// Rows for each unknown of the sample from which leverages are computed; they are then right to a few percent.
constexpr Eigen::Index sample_rows_per_unknown = 200;

// Smallest eigenvalue of a scaled Gram matrix that is inverted: in rows, and relative to the largest one.
constexpr double least_eigenvalue = 1e-6;
constexpr double least_relative_eigenvalue = 1e-12;

// Weighted residual sums of squares of all nodes, outputs x nodes. An inner node has those of its own local model, as
// if it were a leaf.
Eigen::MatrixXd residual_sums(const TrainingRows& training, const Partition& partition, const Evaluator& evaluator,
                              int max_threads, Work& work) {
  const Eigen::Index outputs = std::ssize(partition.outputs);
  Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(outputs, std::ssize(partition.nodes));
  const auto add = [&](const Chunk& chunk, Eigen::MatrixXd& sums) {
    work.check();
    std::vector<Activation> active;
    Eigen::VectorXd values(outputs);
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      const double* inputs = chunk.inputs.row(row).data();
      const double* deviations = chunk.deviations.row(row).data();
      int at = 0;
      for (; !partition.nodes[at].is_leaf(); at = evaluator.child_of(at, inputs)) {
        evaluator.local(at, deviations, values.data());
        evaluator.finish(deviations, values.data());
        sums.col(at) += chunk.weights(row) * (chunk.outputs.row(row).transpose() - values).cwiseAbs2();
      }
      evaluator.activate(inputs, active);
      evaluator.combine(active, deviations, values.data());
      sums.col(at) += chunk.weights(row) * (chunk.outputs.row(row).transpose() - values).cwiseAbs2();
    }
  };
  return sum_over(training, partition.outputs, max_threads, std::move(zero), add);
}

// Sum of weight * validity * a a' over the rows for every leaf, lower triangles; empty for inner nodes.
std::vector<Eigen::MatrixXd> gram_matrices(const TrainingRows& training, const Partition& partition,
                                           const Evaluator& evaluator, int max_threads) {
  const Eigen::Index regressors = std::ssize(training.regressors);
  std::vector<Eigen::MatrixXd> zero;
  for (const Node& node : partition.nodes) {
    const Eigen::Index size = node.is_leaf() ? regressors + 1 : 0;
    zero.push_back(Eigen::MatrixXd::Zero(size, size));
  }
  const auto add = [&](const Chunk& chunk, std::vector<Eigen::MatrixXd>& grams) {
    std::vector<Activation> active;
    Eigen::VectorXd a(regressors + 1);
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      const double* deviations = chunk.deviations.row(row).data();
      evaluator.activate(chunk.inputs.row(row).data(), active);
      for (const Activation& entry : active) {
        const Node& leaf = partition.nodes[entry.node];
        a(0) = 1.0;
        for (Eigen::Index k = 0; k < regressors; ++k) {
          a(k + 1) = imputed(leaf, k, deviations[k]);
        }
        double* gram = grams[entry.node].data();
        for (Eigen::Index j = 0; j <= regressors; ++j, gram += regressors + 1) {
          const double factor = chunk.weights(row) * entry.validity * a(j);
          for (Eigen::Index i = j; i <= regressors; ++i) {
            gram[i] += factor * a(i);
          }
        }
      }
    }
  };
  return sum_over(training, {}, max_threads, std::move(zero), add);
}

// The constant and the regressors with a slope for some output.
std::vector<Eigen::Index> used_coefficients(const Node& node) {
  std::vector<Eigen::Index> used = {0};
  for (Eigen::Index k = 0; k < node.slope.cols(); ++k) {
    if (!node.slope.col(k).isZero(0.0)) {
      used.push_back(k + 1);
    }
  }
  return used;
}

}  // namespace

void count_rows(const TrainingRows& rows, Partition& partition) {
  const Evaluator evaluator(partition, rows.columns, std::ssize(rows.regressors));
  for (Node& node : partition.nodes) node.samples = 0;
  for (Eigen::Index block = 0; block < num_chunks(rows); ++block) {
    const Chunk chunk = fetch(rows, block, {});
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      int at = 0;
      for (; !partition.nodes[at].is_leaf(); at = evaluator.child_of(at, chunk.inputs.row(row).data())) {
        ++partition.nodes[at].samples;
      }
      ++partition.nodes[at].samples;
    }
  }
}

Eigen::MatrixXd inverse_gram(const Eigen::MatrixXd& gram, const Eigen::VectorXd& scale) {
  const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * gram * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  const double floor = std::max(least_eigenvalue, least_relative_eigenvalue * eigen.eigenvalues().maxCoeff());
  const Eigen::MatrixXd result = eigen.eigenvectors() *
                                 eigen.eigenvalues().cwiseMax(floor).cwiseInverse().asDiagonal() *
                                 eigen.eigenvectors().transpose();
  return scale.cwiseInverse().asDiagonal() * result * scale.cwiseInverse().asDiagonal();
}

void describe_leaves(const TrainingRows& training, Partition& partition, bool sparse, int max_threads, Work& work) {
  const Eigen::Index regressors = std::ssize(training.regressors);
  const Evaluator evaluator(partition, training.columns, regressors);
  const Eigen::MatrixXd rss = residual_sums(training, partition, evaluator, max_threads, work);
  const Eigen::Index enough = sample_rows_per_unknown * partition.num_leaves() * (regressors + 1);
  const TrainingRows sample = subsample(training, enough, max_threads);
  work.check();
  const std::vector<Eigen::MatrixXd> gram = gram_matrices(sample, partition, evaluator, max_threads);
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(regressors + 1);
  for (Eigen::Index k = 0; k < regressors; ++k) {
    const double range = std::max(std::abs(partition.nodes[0].low(k)), std::abs(partition.nodes[0].high(k)));
    scale(k + 1) = range > 0.0 ? range : 1.0;
  }
  parallel_for(std::ssize(partition.nodes), max_threads, [&](Eigen::Index index) {
    Node& node = partition.nodes[index];
    node.rss = rss.col(index);
    node.inverse_gram = Eigen::MatrixXd();
    if (node.is_leaf()) {
      const Eigen::MatrixXd full = gram[index].selfadjointView<Eigen::Lower>();
      if (!sparse) {
        node.inverse_gram = inverse_gram(full, scale);
        return;
      }
      const std::vector<Eigen::Index> used = used_coefficients(node);
      node.inverse_gram = Eigen::MatrixXd::Zero(full.rows(), full.cols());
      node.inverse_gram(used, used) = inverse_gram(full(used, used), scale(used));
    }
  });
}

}  // namespace llmt
