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

  /// By LDL', dependent columns left out.
  double rss() const {
    std::array<double, Coefficients * Coefficients> factor{};
    std::array<double, Coefficients> inverse{};
    for (int k = 0; k < Coefficients; ++k) {
      double pivot = gram_[at(k, k)];
      for (int j = 0; j < k; ++j) {
        pivot -= factor[at(k, j)] * factor[at(k, j)] * inverse[j];
      }
      const bool dependent = !(pivot > dependent_column * gram_[at(k, k)]);
      inverse[k] = dependent ? 0.0 : 1.0 / pivot;
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
    return std::max(total, 0.0);
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
  Eigen::Index evaluations = 0;
};

/// Orders and values of the inputs as in llmt::InputSearch. Of splits within the tie tolerance of the best: the first
/// input, then the smallest threshold.
template <int Coefficients>
BruteForceSplit search(const llmt::SearchNode& node, std::span<const std::vector<int>> orders,
                       std::span<const std::vector<double>> values, Eigen::Index min_leaf_samples) {
  constexpr double none = std::numeric_limits<double>::infinity();
  std::vector<std::vector<double>> all;
  BruteForceSplit best;
  for (std::size_t j = 0; j < orders.size(); ++j) {
    const std::vector<int>& order = orders[j];
    const Eigen::Index rows = std::ssize(order);
    const auto admissible = [&](Eigen::Index left) {
      return left >= min_leaf_samples && rows - left >= min_leaf_samples && left > 0 && left < rows &&
             values[j][left - 1] < values[j][left];
    };
    const auto row = [&](Eigen::Index k) { return node.features.row(order[k]); };
    std::vector<double>& rss = all.emplace_back(rows + 1, none);
    NormalEquations<Coefficients> from_left(node.weights);
    for (Eigen::Index left = 1; left <= rows; ++left) {
      from_left.add(row(left - 1));
      if (admissible(left)) {
        rss[left] = from_left.rss();
        ++best.evaluations;
      }
    }
    const double without_value = rows < node.features.rows() ? node.rss - from_left.rss() : 0.0;
    NormalEquations<Coefficients> from_right(node.weights);
    for (Eigen::Index left = rows - 1; left >= 1; --left) {
      from_right.add(row(left));
      if (admissible(left)) {
        rss[left] += from_right.rss() + without_value;
      }
    }
    best.rss = std::min(best.rss, *std::ranges::min_element(rss));
  }
  for (std::size_t j = 0; j < orders.size() && best.input < 0; ++j) {
    const auto found =
        std::ranges::find_if(all[j], [&](double value) { return value < none && value <= best.rss + tie * node.rss; });
    if (found != all[j].end()) {
      best.input = static_cast<int>(j);
      best.left = found - all[j].begin();
    }
  }
  return best;
}

}  // namespace oracle
