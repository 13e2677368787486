#include <algorithm>
#include <numeric>
#include <vector>

#include "growth/search/split_search.hpp"

namespace llmt {
namespace {

// Orders of the levels that occur: by the mean of each residual, and of each residual times each regressor
// (docs/algorithms/data.md, "Splits on categories"). Two levels have one order.
std::vector<std::vector<int>> level_orders(const GramShape& shape, std::span<const double> grams,
                                           std::span<const Eigen::Index> counts) {
  const auto gram = [&](int level) { return grams.data() + level * shape.size(); };
  std::vector<int> seen;
  for (int level = 0; level < std::ssize(counts); ++level) {
    if (counts[level] > 0) {
      seen.push_back(level);
    }
  }
  std::vector<std::vector<int>> orders;
  if (seen.size() < 2) return orders;
  for (Eigen::Index output = shape.coefficients(); output < shape.columns(); ++output) {
    for (Eigen::Index k = 0; k < shape.coefficients(); ++k) {
      orders.push_back(seen);
      std::stable_sort(orders.back().begin(), orders.back().end(), [&](int a, int b) {
        return gram(a)[shape.at(output, k)] / gram(a)[0] < gram(b)[shape.at(output, k)] / gram(b)[0];
      });
      if (seen.size() == 2) return orders;
    }
  }
  return orders;
}

// SplitCandidate::level_side of an order whose first `left` levels go left.
std::vector<int> sides_of_levels(const std::vector<int>& order, std::size_t left, std::size_t levels) {
  std::vector<int> sides(levels, 0);
  for (std::size_t i = 0; i < order.size(); ++i) {
    sides[order[i]] = i < left ? -1 : 1;
  }
  return sides;
}

}  // namespace

SplitCandidate search_level_grams(const GramShape& shape, const Eigen::VectorXd& weights, const AdjustedRss& scale,
                                  double without_value, std::span<const double> grams,
                                  std::span<const Eigen::Index> counts, Eigen::Index min_leaf_samples) {
  const Eigen::Index present = std::accumulate(counts.begin(), counts.end(), Eigen::Index{0});
  const double tolerance = tie_tolerance * scale.of_node();
  ResidualSums models(shape, weights);
  SidesOfCuts sides;
  std::vector<const double*> ordered;
  SplitCandidate best;
  for (const std::vector<int>& order : level_orders(shape, grams, counts)) {
    ordered.clear();
    for (const int level : order) ordered.push_back(grams.data() + level * shape.size());
    sides.sum(shape, ordered);
    sides.evaluate(models);
    Eigen::Index rows_left = 0;
    for (std::size_t k = 0; k < sides.rss_left.size(); ++k) {
      rows_left += counts[order[k]];
      if (rows_left < min_leaf_samples || present - rows_left < min_leaf_samples) continue;
      const double rss = sides.rss_left[k] + sides.rss_right[k] + without_value;
      ++best.tested;
      const int ranks =
          scale.counted(sides.rank_left[k], rows_left) + scale.counted(sides.rank_right[k], present - rows_left);
      const double adjusted = scale.of(rss, ranks);
      if (best.input >= 0 && adjusted >= best.adjusted - tolerance) continue;
      best.input = 0;
      best.adjusted = std::max(0.0, adjusted);
      best.left = rows_left;
      best.rss = std::max(0.0, rss);
      best.rank_left = sides.rank_left[k];
      best.rank_right = sides.rank_right[k];
      best.level_side = sides_of_levels(order, k + 1, counts.size());
    }
  }
  best.evaluations = best.tested;
  return best;
}

SplitCandidate search_levels(const SearchNode& node, std::span<const int> levels, int num_levels,
                             Eigen::Index min_leaf_samples) {
  const GramShape shape(node.features);
  std::vector<double> grams(num_levels * shape.size(), 0.0);
  std::vector<Eigen::Index> counts(num_levels, 0);
  std::vector<double> all(shape.size(), 0.0);
  Eigen::Index present = 0;
  for (int row = 0; row < std::ssize(levels); ++row) {
    if (const int level = levels[row]; level >= 0) {
      add_rows(node.features, &row, 1, grams.data() + level * shape.size());
      ++counts[level];
      ++present;
    }
  }
  double without_value = 0.0;
  if (present < node.features.rows()) {
    for (int level = 0; level < num_levels; ++level) {
      add(shape, grams.data() + level * shape.size(), all.data());
    }
    const double* gram = all.data();
    double rss = 0.0;
    int rank = 0;
    ResidualSums(shape, node.weights).evaluate(&gram, 1, &rss, &rank);
    without_value = node.rss - rss;
  }
  return search_level_grams(shape, node.weights, node.scale(), without_value, grams, counts, min_leaf_samples);
}

}  // namespace llmt
