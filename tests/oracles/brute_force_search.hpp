/// \file
/// Every split of a node compared, with normal equations that grow row by row and a factorisation for each: the oracle
/// of the exact search, and its rival in the benchmarks.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "growth/search/split_search.hpp"
#include "oracles/oracles.hpp"

namespace oracle {

/// A column whose sum of squares falls below this part when the columns before it are taken out counts as dependent.
/// Sums of squares have about 16 digits, and columns that depend on each other leave some 1e-15 to 1e-14 of rounding.
inline constexpr double dependent_column = 1e-12;

/// Splits whose RSS differ by at most this part of the node's RSS are ties (docs/algorithms/split-search.md, "Ties").
inline constexpr double tie = 1e-10;

/// Normal equations of a growing set of rows; `Coefficients` known at compile time lets the loops be unrolled.
template <int Coefficients>
class NormalEquations {
 public:
  explicit NormalEquations(const Eigen::VectorXd& weights) : weights_(weights), products_(weights.size()) {}

  void add(const double* row) {
    for (int i = 0; i < Coefficients; ++i) {
      for (int j = 0; j <= i; ++j) {
        gram_[at(i, j)] += row[i] * row[j];
      }
    }
    for (std::size_t o = 0; o < products_.size(); ++o) {
      const double residual = row[Coefficients + static_cast<int>(o)];
      for (int i = 0; i < Coefficients; ++i) {
        products_[o].sums[i] += row[i] * residual;
      }
      products_[o].squares += residual * residual;
    }
  }

  struct Model {
    double rss;
    int rank;
  };

  /// By LDL', dependent columns left out.
  Model model() const {
    int rank = 0;
    std::array<double, Coefficients * Coefficients> factor{};
    std::array<double, Coefficients> inverse{};
    for (int k = 0; k < Coefficients; ++k) {
      double pivot = gram_[at(k, k)];
      for (int j = 0; j < k; ++j) {
        pivot -= factor[at(k, j)] * factor[at(k, j)] * inverse[j];
      }
      const bool dependent = !(pivot > dependent_column * gram_[at(k, k)]);
      inverse[k] = dependent ? 0.0 : 1.0 / pivot;
      rank += dependent ? 0 : 1;
      for (int i = k + 1; i < Coefficients; ++i) {
        double sum = gram_[at(i, k)];
        for (int j = 0; j < k; ++j) {
          sum -= factor[at(i, j)] * factor[at(k, j)] * inverse[j];
        }
        factor[at(i, k)] = sum;
      }
    }
    double total = 0.0;
    for (std::size_t o = 0; o < products_.size(); ++o) {
      std::array<double, Coefficients> solution = products_[o].sums;
      double left = products_[o].squares;
      for (int k = 0; k < Coefficients; ++k) {
        double& value = solution[k];
        for (int j = 0; j < k; ++j) {
          value -= factor[at(k, j)] * inverse[j] * solution[j];
        }
        left -= value * value * inverse[k];
      }
      total += weights_(o) * left;
    }
    return {std::max(total, 0.0), rank};
  }

 private:
  static constexpr std::size_t at(int i, int j) { return i * Coefficients + j; }
  struct Products {
    std::array<double, Coefficients> sums{};
    double squares = 0.0;
  };
  Eigen::VectorXd weights_;
  std::array<double, Coefficients * Coefficients> gram_{};
  std::vector<Products> products_;
};

struct BruteForceSplit {
  int input = -1;
  Eigen::Index left = 0;
  double rss = std::numeric_limits<double>::infinity();
  double adjusted = std::numeric_limits<double>::infinity();
  Eigen::Index evaluations = 0;
};

/// Orders and values of the inputs as in llmt::InputSearch. Splits in which two rows next to the split decide a
/// direction of a child are left out. Of splits within the tie tolerance of the best: the first input, then the
/// smallest threshold.
template <int Coefficients>
BruteForceSplit search(const llmt::SearchNode& node, std::span<const std::vector<int>> orders,
                       std::span<const std::vector<double>> values, Eigen::Index min_leaf_samples) {
  using Model = typename NormalEquations<Coefficients>::Model;
  const WholeNode whole{node.weight, node.rank, node.rss};
  std::vector<BruteForceSplit> all;
  BruteForceSplit best;
  for (int j = 0; j < std::ssize(orders); ++j) {
    const std::vector<int>& order = orders[j];
    const Eigen::Index rows = std::ssize(order);
    const auto row = [&](Eigen::Index k) { return node.features.row(order[k]); };
    std::vector<Model> lefts(rows + 1, Model{0.0, 0});
    NormalEquations<Coefficients> from_left(node.weights);
    for (Eigen::Index left = 1; left <= rows; ++left) {
      from_left.add(row(left - 1));
      lefts[left] = from_left.model();
    }
    const double without_value = rows < node.features.rows() ? node.rss - lefts[rows].rss : 0.0;
    std::vector<Model> rights(rows + 1, Model{0.0, 0});
    NormalEquations<Coefficients> from_right(node.weights);
    for (Eigen::Index left = rows - 1; left >= 0; --left) {
      from_right.add(row(left));
      rights[left] = from_right.model();
    }
    const auto left_side = [&](Eigen::Index left) { return Side{left, lefts[std::max<Eigen::Index>(left, 0)].rank}; };
    const auto right_side = [&](Eigen::Index left) { return Side{rows - left, rights[std::min(left, rows)].rank}; };
    for (Eigen::Index left = 1; left < rows; ++left) {
      if (left < min_leaf_samples || rows - left < min_leaf_samples || !(values[j][left - 1] < values[j][left]))
        continue;
      ++best.evaluations;
      if (two_rows_decide(whole, left_side(left), left_side(left - 2))) continue;
      if (two_rows_decide(whole, right_side(left), right_side(left + 2))) continue;
      const double rss = lefts[left].rss + rights[left].rss + without_value;
      const auto adjusted = static_cast<double>(adjusted_rss(whole, rss, left_side(left), right_side(left)));
      all.push_back({j, left, rss, adjusted, 0});
      best.adjusted = std::min(best.adjusted, all.back().adjusted);
    }
  }
  for (const BruteForceSplit& split : all) {
    if (split.adjusted > best.adjusted + tie * node.rss) continue;
    const Eigen::Index evaluations = best.evaluations;
    best = split;
    best.evaluations = evaluations;
    break;
  }
  return best;
}

}  // namespace oracle
