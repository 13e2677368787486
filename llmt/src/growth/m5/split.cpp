#include "growth/m5/split.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "base/between.hpp"
#include "base/parallel.hpp"
#include "growth/search/split_search.hpp"

namespace llmt {
namespace {

using Rows = std::vector<int>;

// Mean and sum of squares about the mean, row by row (Welford 1962). A side with equal outputs has exactly 0.
struct Spread {
  double weight = 0.0;
  double mean = 0.0;
  double squares = 0.0;

  void add(double weight_of_row, double value) {
    weight += weight_of_row;
    const double change = value - mean;
    mean += weight_of_row / weight * change;
    squares += weight_of_row * change * (value - mean);
  }
  double variance() const { return std::max(squares, 0.0) / weight; }
};

// The power of the variance in Q.1. Quinlan (1992) compares standard deviations; Weka's M5P takes this power, which
// favours small parts with little scatter.
constexpr double root = 1.0 / 5.0;

// Weka's M5P leaves at least one in this many rows on either side of a threshold.
constexpr Eigen::Index least_share = 5;

// The best cut of a sequence of rows.
struct Cut {
  Eigen::Index left = 0;  // rows; 0: nowhere
  double decrease = 0.0;
};

// The largest decrease over the cuts between rows of different `keys`, which ascend, with `fewest` rows on a side.
Cut best_cut(const GrowthData& data, const DeviationNode& node, const Rows& order, const std::vector<double>& keys,
             Eigen::Index fewest = 1) {
  const Eigen::Index count = std::ssize(order);
  const Eigen::Index smallest_leaf = std::max(fewest, data.problem.options.min_leaf_samples);
  if (count < 2 * smallest_leaf) return {};
  const double total = data.total_weight;
  std::vector<double> left_over(count, 0.0);  // with k rows on the left
  double whole = 0.0;
  for (Eigen::Index o = 0; o < data.outputs.cols(); ++o) {
    const double unit = data.output_weights(o) * total;  // 1 / variance over all training rows
    const auto impurity = [&](const Spread& side) { return side.weight * std::pow(unit * side.variance(), root); };
    Spread left;
    Spread right;
    for (Eigen::Index k = 0; k + 1 < count; ++k) {
      const int first = order[k];
      left.add(node.weights(first), data.outputs(first, o));
      left_over[k + 1] += impurity(left);
      const int last = order[count - 1 - k];
      right.add(node.weights(last), data.outputs(last, o));
      left_over[count - 1 - k] += impurity(right);
    }
    right.add(node.weights(order.front()), data.outputs(order.front(), o));
    whole += impurity(right);
  }
  const auto admissible = [&](Eigen::Index k) { return keys[k - 1] < keys[k]; };
  double smallest = std::numeric_limits<double>::infinity();
  for (Eigen::Index k = smallest_leaf; k <= count - smallest_leaf; ++k) {
    if (admissible(k)) {
      smallest = std::min(smallest, left_over[k]);
    }
  }
  for (Eigen::Index k = smallest_leaf; k <= count - smallest_leaf; ++k) {
    if (admissible(k) && left_over[k] <= smallest + tie_tolerance * whole) {
      return {k, whole - left_over[k]};
    }
  }
  return {};
}

DeviationSplit split_number(const GrowthData& data, const DeviationNode& node, int j) {
  const Rows& order = node.orders[j];
  std::vector<double> values(order.size());
  std::ranges::transform(order, values.begin(), [&](int row) { return data.split_value(row, j); });
  DeviationSplit split;
  if (const Cut cut = best_cut(data, node, order, values, std::ssize(order) / least_share); cut.left > 0) {
    split.input = j;
    split.threshold = between(values[cut.left - 1], values[cut.left]);
    split.decrease = cut.decrease;
  }
  return split;
}

DeviationSplit split_levels(const GrowthData& data, const DeviationNode& node, int j) {
  const int levels = data.num_levels[j];
  std::vector<Rows> of_level(levels);
  for (const int row : node.rows) {
    if (const double value = data.split_value(row, j); !std::isnan(value)) {
      of_level[static_cast<std::size_t>(value)].push_back(row);
    }
  }
  DeviationSplit split;
  for (Eigen::Index o = 0; o < data.outputs.cols(); ++o) {
    std::vector<double> mean(levels, 0.0);
    Rows seen;
    for (int level = 0; level < levels; ++level) {
      Spread spread;
      for (const int row : of_level[level]) {
        spread.add(node.weights(row), data.outputs(row, o));
      }
      mean[level] = spread.mean;
      if (!of_level[level].empty()) {
        seen.push_back(level);
      }
    }
    std::ranges::stable_sort(seen, [&](int a, int b) { return mean[a] < mean[b]; });
    Rows order;
    std::vector<double> rank;
    for (int k = 0; k < std::ssize(seen); ++k) {
      const Rows& rows = of_level[seen[k]];
      order.insert(order.end(), rows.begin(), rows.end());
      rank.insert(rank.end(), rows.size(), k);
    }
    const Cut cut = best_cut(data, node, order, rank, std::ssize(order) / least_share);
    if (cut.left > 0 && (split.input < 0 || cut.decrease > split.decrease * (1.0 + tie_tolerance))) {
      split.input = j;
      split.decrease = cut.decrease;
      split.level_side.assign(levels, 0);
      for (int k = 0; k < std::ssize(seen); ++k) {
        split.level_side[seen[k]] = k <= rank[cut.left - 1] ? -1 : 1;
      }
    }
  }
  return split;
}

// Rows with a value against rows without one: it can be informative that a value is missing.
DeviationSplit split_missing(const GrowthData& data, const DeviationNode& node, int j) {
  Rows order;
  for (const bool missing : {false, true}) {
    std::ranges::copy_if(node.rows, std::back_inserter(order),
                         [&](int row) { return std::isnan(data.split_value(row, j)) == missing; });
  }
  std::vector<double> keys;
  std::ranges::transform(order, std::back_inserter(keys),
                         [&](int row) { return std::isnan(data.split_value(row, j)) ? 1.0 : 0.0; });
  DeviationSplit split;
  if (const Cut cut = best_cut(data, node, order, keys); cut.left > 0) {
    split.input = j;
    split.by_missing = true;
    split.decrease = cut.decrease;
  }
  return split;
}

}  // namespace

double relative_deviation(const GrowthData& data, const DeviationNode& node) {
  double sum = 0.0;
  for (Eigen::Index o = 0; o < data.outputs.cols(); ++o) {
    Spread spread;
    for (const int row : node.rows) {
      spread.add(node.weights(row), data.outputs(row, o));
    }
    sum += std::sqrt(data.output_weights(o) * data.total_weight * spread.variance());
  }
  return sum;
}

DeviationSplit largest_decrease(const GrowthData& data, const DeviationNode& node) {
  std::vector<std::array<DeviationSplit, 2>> found(data.split_inputs());
  parallel_for(std::ssize(found), data.threads_for(std::ssize(node.rows) * std::ssize(found)), [&](int j) {
    data.problem.check(std::ssize(node.rows));
    std::array<DeviationSplit, 2>& of_input = found[j];
    if (data.num_levels[j] > 0) {
      of_input[0] = split_levels(data, node, j);
      return;
    }
    of_input[0] = split_number(data, node, j);
    if (node.orders[j].size() < node.rows.size()) {
      of_input[1] = split_missing(data, node, j);
    }
  });
  double largest = 0.0;
  for (const auto& of_input : found) {
    largest = std::max({largest, of_input[0].decrease, of_input[1].decrease});
  }
  const double tolerance = tie_tolerance * data.total_weight;
  for (const auto& of_input : found) {
    for (const DeviationSplit& split : of_input) {
      if (split.input >= 0 && split.decrease > 0.0 && split.decrease >= largest - tolerance) {
        return split;
      }
    }
  }
  return {};
}

}  // namespace llmt
