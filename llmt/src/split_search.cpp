#include "split_search.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <type_traits>
#include <vector>

namespace llmt {
namespace {

constexpr double no_split = std::numeric_limits<double>::infinity();

/// Pivots below this, relative to the sum of squares of their column, count as zero. The rounding of the sums is about
/// 1e-15 of it; what a narrow child legitimately leaves of a direction is larger.
constexpr double pivot_tolerance = 1e-12;

/// Normal equations of a growing set of rows, and the residual sum of squares of their least-squares fit.
///
/// `Regressors` is the number of columns besides the constant if it is known at compile time, or -1.
template <int Regressors>
class NormalEquations {
  static constexpr int fixed = Regressors >= 0 ? Regressors + 1 : -1;

 public:
  NormalEquations(std::ptrdiff_t regressors, std::ptrdiff_t outputs) : size_(regressors + 1), outputs_(outputs) {
    if constexpr (fixed < 0) {
      gram_.resize(static_cast<std::size_t>(size_ * size_));
      factor_.resize(gram_.size());
    } else {
      gram_.fill(0.0);
    }
    products_.resize(static_cast<std::size_t>(size_ * outputs_));
    solution_.resize(products_.size());
    squares_.resize(static_cast<std::size_t>(outputs_));
  }

  /// Adds a row: the constant and the regressors, then residuals.
  void add(const double* row) {
    const std::ptrdiff_t p = size();
    const double* residual = row + p;
    for (std::ptrdiff_t i = 0; i < p; ++i) {
      for (std::ptrdiff_t j = 0; j <= i; ++j) {
        gram(i, j) += row[i] * row[j];
      }
    }
    for (std::ptrdiff_t o = 0; o < outputs_; ++o) {
      double* product = products_.data() + o * p;
      for (std::ptrdiff_t i = 0; i < p; ++i) {
        product[i] += row[i] * residual[o];
      }
      squares_[static_cast<std::size_t>(o)] += residual[o] * residual[o];
    }
  }

  void add(const NormalEquations& other) {
    const auto sum = [](auto& to, const auto& from) {
      for (std::size_t i = 0; i < to.size(); ++i) {
        to[i] += from[i];
      }
    };
    sum(gram_, other.gram_);
    sum(products_, other.products_);
    sum(squares_, other.squares_);
  }

  /// Weighted residual sum of squares, by an LDL' factorisation in which dependent columns are left out; sets `rank`.
  double rss(const Eigen::VectorXd& weights, int& rank) {
    const std::ptrdiff_t p = size();
    std::copy(products_.begin(), products_.end(), solution_.begin());
    double total = 0.0;
    for (std::ptrdiff_t o = 0; o < outputs_; ++o) {
      total += weights(o) * squares_[static_cast<std::size_t>(o)];
    }
    rank = 0;
    for (std::ptrdiff_t k = 0; k < p; ++k) {
      double pivot = gram(k, k);
      for (std::ptrdiff_t j = 0; j < k; ++j) {
        pivot -= factor(k, j) * factor(k, j) * pivot_inverse(j);
      }
      const bool dependent = !(pivot > pivot_tolerance * gram(k, k));
      const double inverse = dependent ? 0.0 : 1.0 / pivot;
      factor(k, k) = inverse;
      rank += dependent ? 0 : 1;
      for (std::ptrdiff_t i = k + 1; i < p; ++i) {
        double sum = gram(i, k);
        for (std::ptrdiff_t j = 0; j < k; ++j) {
          sum -= factor(i, j) * factor(k, j) * pivot_inverse(j);
        }
        factor(i, k) = sum;
      }
      for (std::ptrdiff_t o = 0; o < outputs_; ++o) {
        double* solution = solution_.data() + o * p;
        double sum = solution[k];
        for (std::ptrdiff_t j = 0; j < k; ++j) {
          sum -= factor(k, j) * pivot_inverse(j) * solution[j];
        }
        solution[k] = sum;
        total -= weights(o) * sum * sum * inverse;
      }
    }
    return std::max(total, 0.0);
  }

 private:
  using Storage =
      std::conditional_t<fixed >= 0, std::array<double, static_cast<std::size_t>(fixed < 0 ? 1 : fixed * fixed)>,
                         std::vector<double>>;

  std::ptrdiff_t size() const { return fixed >= 0 ? fixed : size_; }
  double& gram(std::ptrdiff_t i, std::ptrdiff_t j) { return gram_[static_cast<std::size_t>(i * size() + j)]; }
  double& factor(std::ptrdiff_t i, std::ptrdiff_t j) { return factor_[static_cast<std::size_t>(i * size() + j)]; }
  double pivot_inverse(std::ptrdiff_t j) { return factor(j, j); }

  std::ptrdiff_t size_;
  std::ptrdiff_t outputs_;
  Storage gram_{};    // lower triangle of [1, x]'[1, x]
  Storage factor_{};  // below the diagonal L D, on it 1 / D (0 for a dependent column)
  std::vector<double> products_;
  std::vector<double> solution_;
  std::vector<double> squares_;
};

/// Best split of one input, see search_input().
template <int Regressors>
SplitCandidate search(const SearchNode& node, std::span<const double> values, std::span<const int> order,
                      std::ptrdiff_t min_leaf_samples) {
  const std::ptrdiff_t rows = std::ssize(order);
  const std::ptrdiff_t outputs = node.weights.size();
  const auto row_data = [&](std::ptrdiff_t k) {
    return node.features.data() + order[static_cast<std::size_t>(k)] * node.features.cols();
  };
  // Splits are named by the number of rows on their left.
  const auto admissible = [&](std::ptrdiff_t left) {
    return left >= min_leaf_samples && rows - left >= min_leaf_samples &&
           values[static_cast<std::size_t>(left - 1)] < values[static_cast<std::size_t>(left)];
  };

  std::vector<double> rss(static_cast<std::size_t>(rows), no_split);
  std::vector<int> rank_left(rss.size());
  std::vector<int> rank_right(rss.size());
  NormalEquations<Regressors> from_left(node.regressors, outputs);
  for (std::ptrdiff_t left = 1; left <= rows - min_leaf_samples; ++left) {
    from_left.add(row_data(left - 1));
    if (left < rows && admissible(left)) {
      const std::size_t slot = static_cast<std::size_t>(left);
      rss[slot] = from_left.rss(node.weights, rank_left[slot]);
    }
  }
  double without_split = node.rss;
  if (rows < node.features.rows()) {  // some rows have no value: the rest is compared with its own single model
    NormalEquations<Regressors> all = from_left;
    for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(rows - min_leaf_samples, 0); k < rows; ++k) {
      all.add(row_data(k));
    }
    int rank = 0;
    without_split = all.rss(node.weights, rank);
  }
  NormalEquations<Regressors> from_right(node.regressors, outputs);
  for (std::ptrdiff_t left = rows - 1; left >= min_leaf_samples; --left) {
    from_right.add(row_data(left));
    const std::size_t slot = static_cast<std::size_t>(left);
    if (rss[slot] < no_split) {
      rss[slot] += from_right.rss(node.weights, rank_right[slot]);
    }
  }

  SplitCandidate best;
  best.tested = std::count_if(rss.begin(), rss.end(), [](double value) { return value < no_split; });
  if (best.tested > 0) {
    const double smallest = *std::min_element(rss.begin(), rss.end());
    const auto chosen = std::find_if(rss.begin(), rss.end(),
                                     [&](double value) { return value <= smallest + tie_tolerance * node.rss; });
    const std::size_t slot = static_cast<std::size_t>(chosen - rss.begin());
    best.input = 0;
    best.left = static_cast<std::ptrdiff_t>(slot);
    best.rss = std::max(0.0, rss[slot] + (node.rss - without_split));
    best.rank_left = rank_left[slot];
    best.rank_right = rank_right[slot];
  }
  return best;
}

/// Orders of the levels that are seen, by the mean of each residual and of each residual times each regressor.
std::vector<std::vector<int>> level_orders(const SearchNode& node, std::span<const int> levels, int num_levels) {
  const std::ptrdiff_t p = node.regressors + 1;
  const std::ptrdiff_t outputs = node.weights.size();
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(p * outputs, num_levels);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(num_levels);
  for (std::ptrdiff_t row = 0; row < node.features.rows(); ++row) {
    const int level = levels[static_cast<std::size_t>(row)];
    if (level < 0) {
      continue;
    }
    weights(level) += node.features(row, 0) * node.features(row, 0);
    for (std::ptrdiff_t o = 0; o < outputs; ++o) {
      sums.col(level).segment(o * p, p) += node.features(row, p + o) * node.features.row(row).head(p).transpose();
    }
  }
  std::vector<int> seen;
  for (int level = 0; level < num_levels; ++level) {
    if (weights(level) > 0.0) {
      seen.push_back(level);
    }
  }
  std::vector<std::vector<int>> orders;
  if (seen.size() < 2) {
    return orders;
  }
  for (std::ptrdiff_t score = 0; score < (seen.size() > 2 ? sums.rows() : 1); ++score) {
    orders.push_back(seen);
    std::stable_sort(orders.back().begin(), orders.back().end(),
                     [&](int a, int b) { return sums(score, a) / weights(a) < sums(score, b) / weights(b); });
  }
  return orders;
}

}  // namespace

SplitCandidate search_levels(const SearchNode& node, std::span<const int> levels, int num_levels,
                             std::ptrdiff_t min_leaf_samples) {
  using Sums = NormalEquations<-1>;
  const std::ptrdiff_t outputs = node.weights.size();
  std::vector<Sums> of_level(static_cast<std::size_t>(num_levels), Sums(node.regressors, outputs));
  std::vector<std::ptrdiff_t> count(of_level.size(), 0);
  Sums all(node.regressors, outputs);
  std::ptrdiff_t present = 0;
  for (std::ptrdiff_t row = 0; row < node.features.rows(); ++row) {
    const int level = levels[static_cast<std::size_t>(row)];
    if (level >= 0) {
      of_level[static_cast<std::size_t>(level)].add(node.features.row(row).data());
      ++count[static_cast<std::size_t>(level)];
      ++present;
    }
  }
  for (const Sums& sums : of_level) {
    all.add(sums);
  }
  int rank = 0;
  const double without_split = present < node.features.rows() ? all.rss(node.weights, rank) : node.rss;

  SplitCandidate best;
  for (const std::vector<int>& order : level_orders(node, levels, num_levels)) {
    std::vector<Sums> from_right(order.size(), Sums(node.regressors, outputs));  // levels from a position on
    for (std::size_t k = order.size(); k-- > 0;) {
      if (k + 1 < order.size()) {
        from_right[k] = from_right[k + 1];
      }
      from_right[k].add(of_level[static_cast<std::size_t>(order[k])]);
    }
    Sums from_left(node.regressors, outputs);
    std::ptrdiff_t left = 0;
    for (std::size_t k = 0; k + 1 < order.size(); ++k) {
      from_left.add(of_level[static_cast<std::size_t>(order[k])]);
      left += count[static_cast<std::size_t>(order[k])];
      if (left < min_leaf_samples || present - left < min_leaf_samples) {
        continue;
      }
      int rank_left = 0;
      int rank_right = 0;
      const double rss = from_left.rss(node.weights, rank_left) + from_right[k + 1].rss(node.weights, rank_right) +
                         (node.rss - without_split);
      ++best.tested;
      if (best.input < 0 || rss < best.rss - tie_tolerance * node.rss) {
        best.input = 0;
        best.left = left;
        best.rss = std::max(0.0, rss);
        best.rank_left = rank_left;
        best.rank_right = rank_right;
        best.level_side.assign(static_cast<std::size_t>(num_levels), 0);
        for (std::size_t i = 0; i < order.size(); ++i) {
          best.level_side[static_cast<std::size_t>(order[i])] = i <= k ? -1 : 1;
        }
      }
    }
  }
  return best;
}

SearchNode make_search_node(const NodeFit& fit, const Eigen::VectorXd& weights) {
  SearchNode node;
  node.regressors = fit.basis.cols();
  node.features.resize(fit.basis.rows(), 1 + fit.basis.cols() + fit.residuals.cols());
  node.features.col(0) = fit.root_weights;
  node.features.middleCols(1, fit.basis.cols()) = fit.basis;
  node.features.rightCols(fit.residuals.cols()) = fit.root_weights.asDiagonal() * fit.residuals;
  node.weights = weights;
  node.rss = weights.dot(fit.rss);
  return node;
}

SplitCandidate search_input(const SearchNode& node, std::span<const double> values, std::span<const int> order,
                            std::ptrdiff_t min_leaf_samples) {
  // Sizes known at compile time let the small triangular loops be unrolled.
  switch (node.regressors) {
    case 1:
      return search<1>(node, values, order, min_leaf_samples);
    case 2:
      return search<2>(node, values, order, min_leaf_samples);
    case 3:
      return search<3>(node, values, order, min_leaf_samples);
    case 4:
      return search<4>(node, values, order, min_leaf_samples);
    case 5:
      return search<5>(node, values, order, min_leaf_samples);
    case 6:
      return search<6>(node, values, order, min_leaf_samples);
    case 7:
      return search<7>(node, values, order, min_leaf_samples);
    case 8:
      return search<8>(node, values, order, min_leaf_samples);
    default:
      return search<-1>(node, values, order, min_leaf_samples);
  }
}

}  // namespace llmt
