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

/// Normal equations of a growing set of rows; `Coefficients` known at compile time lets the loops be unrolled.
template <int Coefficients>
class NormalEquations {
 public:
  explicit NormalEquations(const Eigen::VectorXd& weights)
      : weights_(weights), products_(static_cast<std::size_t>(weights.size())) {}

  void add(const double* row) {
    for (int i = 0; i < Coefficients; ++i) {
      for (int j = 0; j <= i; ++j) {
        gram_[at(i, j)] += row[i] * row[j];
      }
    }
    for (std::size_t o = 0; o < products_.size(); ++o) {
      const double residual = row[Coefficients + static_cast<int>(o)];
      for (int i = 0; i < Coefficients; ++i) {
        products_[o].sums[static_cast<std::size_t>(i)] += row[i] * residual;
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
        pivot -= factor[at(k, j)] * factor[at(k, j)] * inverse[static_cast<std::size_t>(j)];
      }
      const bool dependent = !(pivot > llmt::pivot_tolerance * gram_[at(k, k)]);
      inverse[static_cast<std::size_t>(k)] = dependent ? 0.0 : 1.0 / pivot;
      for (int i = k + 1; i < Coefficients; ++i) {
        double sum = gram_[at(i, k)];
        for (int j = 0; j < k; ++j) {
          sum -= factor[at(i, j)] * factor[at(k, j)] * inverse[static_cast<std::size_t>(j)];
        }
        factor[at(i, k)] = sum;
      }
    }
    double total = 0.0;
    for (std::size_t o = 0; o < products_.size(); ++o) {
      std::array<double, Coefficients> solution = products_[o].sums;
      double left = products_[o].squares;
      for (int k = 0; k < Coefficients; ++k) {
        double& value = solution[static_cast<std::size_t>(k)];
        for (int j = 0; j < k; ++j) {
          value -= factor[at(k, j)] * inverse[static_cast<std::size_t>(j)] * solution[static_cast<std::size_t>(j)];
        }
        left -= value * value * inverse[static_cast<std::size_t>(k)];
      }
      total += weights_(static_cast<std::ptrdiff_t>(o)) * left;
    }
    return std::max(total, 0.0);
  }

 private:
  static constexpr std::size_t at(int i, int j) { return static_cast<std::size_t>(i * Coefficients + j); }
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
  std::ptrdiff_t left = 0;
  double rss = std::numeric_limits<double>::infinity();
  std::ptrdiff_t evaluations = 0;
};

/// Orders and values of the inputs as in llmt::InputSearch. Of splits within the tie tolerance of the best: the first
/// input, then the smallest threshold.
template <int Coefficients>
BruteForceSplit search(const llmt::SearchNode& node, std::span<const std::vector<int>> orders,
                       std::span<const std::vector<double>> values, std::ptrdiff_t min_leaf_samples) {
  constexpr double none = std::numeric_limits<double>::infinity();
  std::vector<std::vector<double>> all;
  BruteForceSplit best;
  for (std::size_t j = 0; j < orders.size(); ++j) {
    const std::vector<int>& order = orders[j];
    const std::ptrdiff_t rows = std::ssize(order);
    const auto admissible = [&](std::ptrdiff_t left) {
      return left >= min_leaf_samples && rows - left >= min_leaf_samples && left > 0 && left < rows &&
             values[j][static_cast<std::size_t>(left - 1)] < values[j][static_cast<std::size_t>(left)];
    };
    const auto row = [&](std::ptrdiff_t k) { return node.features.row(order[static_cast<std::size_t>(k)]); };
    std::vector<double>& rss = all.emplace_back(static_cast<std::size_t>(rows) + 1, none);
    NormalEquations<Coefficients> from_left(node.weights);
    for (std::ptrdiff_t left = 1; left <= rows; ++left) {
      from_left.add(row(left - 1));
      if (admissible(left)) {
        rss[static_cast<std::size_t>(left)] = from_left.rss();
        ++best.evaluations;
      }
    }
    const double without_value = rows < node.features.rows() ? node.rss - from_left.rss() : 0.0;
    NormalEquations<Coefficients> from_right(node.weights);
    for (std::ptrdiff_t left = rows - 1; left >= 1; --left) {
      from_right.add(row(left));
      if (admissible(left)) {
        rss[static_cast<std::size_t>(left)] += from_right.rss() + without_value;
      }
    }
    best.rss = std::min(best.rss, *std::min_element(rss.begin(), rss.end()));
  }
  for (std::size_t j = 0; j < orders.size() && best.input < 0; ++j) {
    const auto found = std::find_if(all[j].begin(), all[j].end(), [&](double value) {
      return value < none && value <= best.rss + llmt::tie_tolerance * node.rss;
    });
    if (found != all[j].end()) {
      best.input = static_cast<int>(j);
      best.left = found - all[j].begin();
    }
  }
  return best;
}

}  // namespace oracle
