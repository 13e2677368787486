#include "estimation/sums/leaf_sums.hpp"

#include <algorithm>

#include "base/count.hpp"
#include "base/parallel.hpp"
#include "constraints/monotone_splits.hpp"
#include "constraints/signs.hpp"
#include "estimation/sums/assembly.hpp"
#include "numerics/forward_selection.hpp"
#include "partition/imputed.hpp"
#include "partition/tree.hpp"

namespace llmt {
namespace {

// Shrinkage that is always there, in rows. It does not change what the rows determine, and keeps the parent's slopes
// where they determine nothing.
constexpr double least_shrinkage = 1e-6;

// The same for columns that are constant in a leaf, whose variance there is rounding: relative to the leaf's weight,
// in columns of unit variance over all rows.
constexpr double least_diagonal = 1e-12;

// The coefficients that forward selection takes from the sums of a node.
std::vector<Eigen::Index> select(const LeafSums& sums, std::size_t node) {
  const TrainingRows& training = *sums.training;
  // AICc counts rows. If a sample stands for all rows by its weights, it counts those of the sample.
  const double rows_per_weight = static_cast<double>(training.count()) / total_weight(training);
  // Sums of the outputs, from those of the residuals of the root's model.
  const NormalEquations& equations = sums.equations;
  LocalSums of_outputs{equations.gram[node], equations.products[node] + equations.gram[node] * sums.root,
                       equations.squares[node]};
  of_outputs.squares +=
      sums.root.cwiseProduct(of_outputs.products + equations.products[node]).colwise().sum().transpose();
  return select_regressors(of_outputs, rows_per_weight);
}

}  // namespace

Eigen::MatrixXd residual_range(const TrainingRows& rows, const Node& root, const std::vector<int>& outputs,
                               int max_threads) {
  using Extents = std::vector<Extent>;
  const auto add = [&](const Chunk& chunk, Extents& extents) {
    for (Eigen::Index r = 0; r < chunk.count(); ++r) {
      const Eigen::VectorXd residual =
          chunk.outputs.row(r).transpose() - root.value - root.slope * imputed(root, chunk.deviations.row(r));
      for (std::size_t o = 0; o < extents.size(); ++o) extents[o].widen(residual(o));
    }
  };
  const Extents extents = sum_over(rows, outputs, max_threads, Extents(outputs.size()), add);
  Eigen::MatrixXd range(std::ssize(extents), 2);
  for (std::size_t o = 0; o < extents.size(); ++o) range.row(o) << extents[o].low, extents[o].high;
  return range;
}

LeafSums sum_leaves(const TrainingRows& training, Partition partition, int max_threads, bool sparse) {
  const Node& root = partition.nodes.front();
  const Eigen::Index regressors = std::ssize(training.regressors);
  partition.residual_range = residual_range(training, root, partition.outputs, max_threads);
  Eigen::MatrixXd of_root(regressors + 1, root.value.size());
  of_root.row(0) = root.value.transpose();
  of_root.bottomRows(regressors) = training.scale.asDiagonal() * root.slope.transpose();
  NormalEquations equations = assemble(training, partition, of_root, max_threads);
  if (has_ordered_splits(partition, training)) {
    prepare_ordered_splits(partition, training);
  }
  LeafSums sums{&training,
                max_threads,
                std::move(partition),
                std::move(of_root),
                std::move(equations),
                {},
                coefficient_signs(training)};
  if (sparse) {
    sums.selected.resize(sums.partition.nodes.size());
    parallel_for(std::ssize(sums.selected), max_threads,
                 [&](Eigen::Index node) { sums.selected[node] = select(sums, node); });
  }
  return sums;
}

bool has_ordered_leaves(const LeafSums& sums) { return has_ordered_splits(sums.partition, *sums.training); }

Eigen::VectorXd shrinkage_diagonal(const LeafSums& sums, std::size_t node, double shrinkage) {
  const Eigen::MatrixXd& gram = sums.equations.gram[node];
  const double total = gram(0, 0);
  const double floor = least_diagonal * (total + 1.0);
  Eigen::VectorXd result = Eigen::VectorXd::Constant(sums.size(), floor);
  result(0) = total > 0.0 ? 0.0 : floor;  // rows always determine the constant
  for (Eigen::Index k = 1; k < sums.size() && total > 0.0; ++k) {
    const double variance = std::max(0.0, (gram(k, k) - gram(0, k) * gram(0, k) / total) / total);
    result(k) += (shrinkage + least_shrinkage) * variance;
  }
  return result;
}

void set_model(const LeafSums& sums, const Eigen::MatrixXd& coefficients, Node& node) {
  const Eigen::MatrixXd total = coefficients + sums.root;
  node.value = total.row(0).transpose();
  node.slope = total.bottomRows(sums.size() - 1).transpose() * sums.training->scale.cwiseInverse().asDiagonal();
}

Partition with_models(const LeafSums& sums, Eigen::Index leaves, const std::vector<Eigen::MatrixXd>& models,
                      bool sparse) {
  Partition result = grown_prefix(sums.partition, leaves);
  for (std::size_t i = 0; i < result.nodes.size(); ++i) {
    set_model(sums, models[i], result.nodes[i]);
    if (sparse && (i > 0 || leaves == 1)) {
      result.nodes[i].rank = count_of(sums.selected[i]);
    }
  }
  return result;
}

}  // namespace llmt
