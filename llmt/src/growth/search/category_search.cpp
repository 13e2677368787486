#include <algorithm>
#include <vector>

#include "growth/search/split_search.hpp"

namespace llmt {
namespace {

// Orders of the levels that are seen, by the mean of each residual and of each residual times each regressor.
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

}  // namespace

SplitCandidate search_level_grams(const GramShape& shape, const Eigen::VectorXd& weights, double node_rss,
                                  double without_value, std::span<const double> grams,
                                  std::span<const Eigen::Index> counts, Eigen::Index min_leaf_samples) {
  const Eigen::Index size = shape.size();
  const auto gram = [&](int level) { return grams.data() + level * size; };
  Eigen::Index present = 0;
  for (const Eigen::Index count : counts) {
    present += count;
  }
  ResidualSums sums(shape, weights);
  SplitCandidate best;
  for (const std::vector<int>& order : level_orders(shape, grams, counts)) {
    const Eigen::Index cuts = std::ssize(order) - 1;
    std::vector<double> left(cuts * size);
    std::vector<double> right(left.size());
    std::vector<const double*> at_left;
    std::vector<const double*> at_right;
    for (Eigen::Index k = 0; k < cuts; ++k) {
      double* const to = left.data() + k * size;
      if (k > 0) {
        std::copy(to - size, to, to);
      }
      add(shape, gram(order[k]), to);
      at_left.push_back(to);
      at_right.push_back(right.data() + k * size);
    }
    for (Eigen::Index k = cuts; k-- > 0;) {
      double* const to = right.data() + k * size;
      if (k + 1 < cuts) {
        std::copy(to + size, to + 2 * size, to);
      }
      add(shape, gram(order[k + 1]), to);
    }
    std::vector<double> rss_left(cuts);
    std::vector<double> rss_right(rss_left.size());
    std::vector<int> rank_left(rss_left.size());
    std::vector<int> rank_right(rss_left.size());
    sums.evaluate(at_left.data(), cuts, rss_left.data(), rank_left.data());
    sums.evaluate(at_right.data(), cuts, rss_right.data(), rank_right.data());
    Eigen::Index rows_left = 0;
    for (std::size_t k = 0; k < rss_left.size(); ++k) {
      rows_left += counts[order[k]];
      if (rows_left < min_leaf_samples || present - rows_left < min_leaf_samples) continue;
      const double rss = rss_left[k] + rss_right[k] + without_value;
      ++best.tested;
      if (best.input < 0 || rss < best.rss - tie_tolerance * node_rss) {
        best.input = 0;
        best.left = rows_left;
        best.rss = std::max(0.0, rss);
        best.rank_left = rank_left[k];
        best.rank_right = rank_right[k];
        best.level_side.assign(counts.size(), 0);
        for (std::size_t i = 0; i < order.size(); ++i) {
          best.level_side[order[i]] = i <= k ? -1 : 1;
        }
      }
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
  for (std::size_t row = 0; row < levels.size(); ++row) {
    if (const int level = levels[row]; level >= 0) {
      const int index = static_cast<int>(row);
      add_rows(node.features, &index, 1, grams.data() + level * shape.size());
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
  return search_level_grams(shape, node.weights, node.rss, without_value, grams, counts, min_leaf_samples);
}

}  // namespace llmt
