#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "estimate.hpp"
#include "evaluator.hpp"
#include "parallel.hpp"

namespace llmt {
namespace {

/// Sums over rows for every node.
struct Sums {
  Eigen::MatrixXd rss;                // outputs x nodes
  std::vector<Eigen::MatrixXd> gram;  // of leaves, lower triangles
};

/// Pseudo-inverse in scaled columns, with a floor: a direction without rows has a large leverage, not an infinite one.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& gram, const Eigen::VectorXd& scale) {
  const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * gram * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  const double floor = std::max(1e-6, 1e-12 * eigen.eigenvalues().maxCoeff());
  const Eigen::MatrixXd result = eigen.eigenvectors() *
                                 eigen.eigenvalues().cwiseMax(floor).cwiseInverse().asDiagonal() *
                                 eigen.eigenvectors().transpose();
  return scale.cwiseInverse().asDiagonal() * result * scale.cwiseInverse().asDiagonal();
}

}  // namespace

void describe_leaves(const TrainingRows& training, Partition& partition, int max_threads) {
  const std::ptrdiff_t regressors = std::ssize(training.regressors);
  const std::ptrdiff_t outputs = std::ssize(partition.outputs);
  const Evaluator evaluator(partition, training.columns, regressors);
  Sums zero{Eigen::MatrixXd::Zero(outputs, std::ssize(partition.nodes)), {}};
  for (const Node& node : partition.nodes) {
    const std::ptrdiff_t size = node.is_leaf() ? regressors + 1 : 0;
    zero.gram.push_back(Eigen::MatrixXd::Zero(size, size));
  }
  std::vector<Sums> of_slot(static_cast<std::size_t>(std::min(num_slots, num_chunks(training))), zero);
  for_each_chunk(training, partition.outputs, max_threads, [&](std::size_t slot, const Chunk& chunk) {
    Sums& sums = of_slot[slot];
    std::vector<Activation> active;
    Eigen::VectorXd values(outputs);
    Eigen::VectorXd a(regressors + 1);
    for (std::ptrdiff_t row = 0; row < chunk.count(); ++row) {
      const double* inputs = chunk.inputs.row(row).data();
      const double* deviations = chunk.deviations.row(row).data();
      const double weight = chunk.weights(row);
      evaluator.activate(inputs, active);
      int at = 0;
      for (; !partition.nodes[static_cast<std::size_t>(at)].is_leaf(); at = evaluator.child_of(at, inputs)) {
        // An inner node for its own local model, as if it were a leaf.
        evaluator.local(at, deviations, values.data());
        evaluator.finish(deviations, values.data());
        sums.rss.col(at) += weight * (chunk.outputs.row(row).transpose() - values).cwiseAbs2();
      }
      evaluator.combine(active, deviations, values.data());
      sums.rss.col(at) += weight * (chunk.outputs.row(row).transpose() - values).cwiseAbs2();
      for (const Activation& entry : active) {
        const Node& leaf = partition.nodes[static_cast<std::size_t>(entry.node)];
        a(0) = 1.0;
        for (std::ptrdiff_t k = 0; k < regressors; ++k) {
          a(k + 1) = std::isnan(deviations[k]) ? leaf.mean(k) : deviations[k];
        }
        double* gram = sums.gram[static_cast<std::size_t>(entry.node)].data();
        for (std::ptrdiff_t j = 0; j <= regressors; ++j, gram += regressors + 1) {
          const double factor = weight * entry.validity * a(j);
          for (std::ptrdiff_t i = j; i <= regressors; ++i) {
            gram[i] += factor * a(i);
          }
        }
      }
    }
  });
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(regressors + 1);
  for (std::ptrdiff_t k = 0; k < regressors; ++k) {
    const double range = std::max(std::abs(partition.nodes[0].low(k)), std::abs(partition.nodes[0].high(k)));
    scale(k + 1) = range > 0.0 ? range : 1.0;
  }
  parallel_for(std::ssize(partition.nodes), max_threads, [&](std::ptrdiff_t index) {
    Node& node = partition.nodes[static_cast<std::size_t>(index)];
    Eigen::MatrixXd& gram = of_slot[0].gram[static_cast<std::size_t>(index)];
    node.rss = of_slot[0].rss.col(index);
    for (std::size_t slot = 1; slot < of_slot.size(); ++slot) {
      node.rss += of_slot[slot].rss.col(index);
      gram += of_slot[slot].gram[static_cast<std::size_t>(index)];
    }
    node.inverse_gram = node.is_leaf() ? inverse(gram.selfadjointView<Eigen::Lower>(), scale) : Eigen::MatrixXd();
  });
}

}  // namespace llmt
