#include "growth/best_first/residual_leaves.hpp"

#include <algorithm>
#include <limits>

#include "base/parallel.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index rows_of_task = 4096;

// Rows are prefetched this many rows before they are needed, because the rows of a node are scattered over the
// features.
constexpr Eigen::Index ahead = 12;

}  // namespace

ResidualLeaf ResidualLeaves::root() const {
  ResidualLeaf leaf{whitened_root(data_), {}, {}, {}};
  leaf.values = data_.training.table->inputs(data_.training.rows, data_.problem.options.split_inputs);
  leaf.gram = sum_gram(rows_.features(), leaf.rows, data_.problem.max_threads);
  return leaf;
}

// Residuals of the node's model times the square root of the row's weight; only their signs count.
Eigen::MatrixXd ResidualLeaves::residuals(const ResidualLeaf& leaf, const Node& node, int threads) const {
  const Features& features = rows_.features();
  const Eigen::Index count = std::ssize(leaf.rows);
  const Eigen::Index coefficients = features.coefficients();
  // In the features' own regressors, about the model whose residuals they hold.
  Eigen::MatrixXd model(features.outputs(), coefficients);
  model.col(0) = node.value - leaf.value;
  model.rightCols(coefficients - 1) = (node.slope - leaf.slope) * data_.training.scale.asDiagonal() * rows_.colouring();
  Eigen::MatrixXd result(count, features.outputs());
  parallel_for((count + rows_of_task - 1) / rows_of_task, threads, [&](Eigen::Index block) {
    for (Eigen::Index k = block * rows_of_task; k < std::min(count, (block + 1) * rows_of_task); ++k) {
      features.prefetch(leaf.rows[std::min(count - 1, k + ahead)]);
      const double* const row = features.row(leaf.rows[k]);
      for (Eigen::Index o = 0; o < features.outputs(); ++o) {
        double predicted = 0.0;
        for (Eigen::Index c = 0; c < coefficients; ++c) {
          predicted += model(o, c) * row[c];
        }
        result(k, o) = row[coefficients + o] - predicted;
      }
    }
  });
  return result;
}

SplitCandidate ResidualLeaves::search_categories(const ResidualLeaf& leaf, Eigen::Index j,
                                                 const AdjustedRss& scale) const {
  const GramShape shape(rows_.features());
  std::vector<std::vector<int>> of_level(data_.num_levels[j]);
  for (Eigen::Index k = 0; k < std::ssize(leaf.rows); ++k) {
    of_level[static_cast<Eigen::Index>(leaf.values(k, j))].push_back(leaf.rows[k]);
  }
  std::vector<double> grams(of_level.size() * shape.size(), 0.0);
  std::vector<Eigen::Index> counts;
  for (std::size_t level = 0; level < of_level.size(); ++level) {
    counts.push_back(std::ssize(of_level[level]));
    std::ranges::copy(sum_gram(rows_.features(), of_level[level], 1), grams.data() + level * shape.size());
  }
  return search_level_grams(shape, data_.output_weights, scale, 0.0, grams, counts,
                            data_.problem.options.min_leaf_samples);
}

SplitCandidate ResidualLeaves::examine(ResidualLeaf& leaf, const Node& parent, Node& node) {
  const int threads = data_.threads_for(std::ssize(leaf.rows) * data_.split_inputs());
  fit_whitened(data_, rows_, leaf.gram, parent, leaf, node);
  if (refreshed(data_, rows_, leaf.gram, node, leaf)) {
    leaf.gram = sum_gram(rows_.features(), leaf.rows, threads);
    fit_whitened(data_, rows_, leaf.gram, parent, leaf, node);
  }
  if (std::ssize(leaf.rows) < 2 * data_.problem.options.min_leaf_samples) return {};
  const double rss = data_.output_weights.dot(node.rss);
  const Eigen::MatrixXd left_over = residuals(leaf, node, threads);
  const Eigen::VectorXd weights = data_.weights(leaf.rows);
  const SearchNode search{rows_.features(), data_.output_weights, rss, leaf.weight, node.rank};
  ResidualSplit numeric =
      search_by_residuals(data_, {search, leaf.rows, leaf.values, left_over, weights, leaf.gram, threads});
  std::vector<SplitCandidate> found(data_.num_levels.size());
  parallel_for(std::ssize(found), threads, [&](Eigen::Index j) {
    if (data_.num_levels[j] > 0) {
      found[j] = search_categories(leaf, j, search.scale());
    }
  });
  if (numeric.best.input >= 0) {
    found[numeric.best.input] = numeric.best;
  }
  const SplitCandidate best = first_of_best(found, rss);
  if (best.level_side.empty()) {
    leaf.child_grams = std::move(numeric.grams);
  }
  return best;
}

std::array<ResidualLeaf, 2> ResidualLeaves::divide(ResidualLeaf& leaf, const SplitCandidate& split) const {
  std::array<ResidualLeaf, 2> children;
  std::array<std::vector<int>, 2> positions;
  for (int k = 0; k < std::ssize(leaf.rows); ++k) {
    const double value = leaf.values(k, split.input);
    const bool left =
        split.level_side.empty() ? value <= split.last_left : split.level_side[static_cast<std::size_t>(value)] < 0;
    positions[left ? 0 : 1].push_back(k);
    children[left ? 0 : 1].rows.push_back(leaf.rows[k]);
  }
  for (std::size_t side = 0; side < 2; ++side) {
    children[side].values = leaf.values(positions[side], Eigen::all);
    children[side].value = leaf.value;
    children[side].slope = leaf.slope;
    children[side].gram = split.level_side.empty()
                              ? std::move(leaf.child_grams[side])
                              : sum_gram(rows_.features(), children[side].rows, data_.problem.max_threads);
  }
  return children;
}

double ResidualLeaves::threshold(const ResidualLeaf& leaf, const SplitCandidate& split, const Node& node,
                                 const Node& left, const Node& right) const {
  double low = -std::numeric_limits<double>::infinity();
  double high = -low;
  for (const double value : leaf.values.col(split.input)) {
    (value <= split.last_left ? low : high) = value <= split.last_left ? std::max(low, value) : std::min(high, value);
  }
  return place_threshold(data_, leaf, split.input, low, high, node, left, right);
}

}  // namespace llmt
