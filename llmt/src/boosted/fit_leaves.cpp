// The leaves of a tree whose splits are there.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "base/parallel.hpp"
#include "base/sum_over.hpp"
#include "boosted/growing_tree.hpp"
#include "boosted/model/transition.hpp"

namespace llmt {
namespace {

// Calls to(leaf, share) for the leaves that hold a row.
template <class To>
void visit(const GrowingTree& tree, const BinnedRows& rows, Eigen::Index row, int index, double share, const To& to) {
  while (tree[index].feature >= 0) {
    const GrowingNode& node = tree[index];
    const BinnedFeature& column = rows.features[node.feature];
    const std::uint16_t cell = column.cells[row];
    if (cell == missing_cell) {
      const double left = node.missing_left;
      if (left > 0.0 && left < 1.0) visit(tree, rows, row, node.left, share * left, to);
      share *= left == 1.0 ? 1.0 : 1.0 - left;
      index = left == 1.0 ? node.left : node.right;
      continue;
    }
    if (node.half_width > 0.0) {
      const double z = column.values[row];
      if (std::abs(z - column.edges[node.cell]) < node.half_width) {
        const double right = share_of_right(z, column.edges[node.cell], node.half_width);
        if (goes_both_ways(share, right)) {
          visit(tree, rows, row, node.left, share * (1.0 - right), to);
          share *= right;
          index = node.right;
          continue;
        }
      }
    }
    index = cell <= node.cell ? node.left : node.right;
  }
  to(index, share);
}

bool is_soft(const GrowingTree& tree) {
  return std::ranges::any_of(tree, [](const GrowingNode& node) { return node.half_width > 0.0; });
}

// The compiler knows the number of slopes and unrolls the loops over them.
template <int size, bool is_soft, bool is_weighted>
RegressorSums regressor_sums(const PathModel& model, const BinnedRows& all, std::span<const int> rows,
                             std::span<const double> shares, const Eigen::VectorXd& residuals) {
  RegressorSums sums;
  std::array<const float*, size> values;
  std::array<double, size> slopes;
  for (int j = 0; j < size; ++j) {
    values[j] = all.features[model.features[j]].values.data();
    slopes[j] = model.slopes[j];
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Eigen::Index row = rows[k];
    const double weight = is_weighted ? all.weights(row) : 1.0;
    const double w = is_soft ? shares[k] * weight : weight;
    const double residual = residuals(row);
    if (!is_soft || shares[k] >= 0.5) {
      sums.low = std::min(sums.low, residual);
      sums.high = std::max(sums.high, residual);
    }
    std::array<double, size> z;
    double e = residual - model.constant;
    for (int j = 0; j < size; ++j) {
      z[j] = values[j][row];
      e -= slopes[j] * z[j];
    }
    sums.n += w;
    sums.s += w * e;
    for (int j = 0; j < size; ++j) {
      const double weighted = w * z[j];
      sums.z[j] += weighted;
      sums.ze[j] += weighted * e;
      for (int i = 0; i <= j; ++i) sums.zz[j][i] += w * z[j] * z[i];
    }
  }
  return sums;
}

// PathModel::at() with a number of slopes that the compiler knows.
template <int size>
struct PathValues {
  PathValues(const PathModel& model, const BinnedRows& rows) : constant(model.constant) {
    for (int j = 0; j < size; ++j) {
      slopes[j] = model.slopes[j];
      values[j] = rows.features[model.features[j]].values.data();
    }
  }
  double at(Eigen::Index row) const {
    double value = constant;
    for (int j = 0; j < size; ++j) value += slopes[j] * static_cast<double>(values[j][row]);
    return value;
  }

  double constant;
  std::array<double, size> slopes;
  std::array<const float*, size> values;
};

// Calls of(size) with the size, up to `most`, as a constant.
template <int most, class Of>
auto with_size(int size, const Of& of) {
  if constexpr (most > 0) {
    if (size < most) return with_size<most - 1>(size, of);
  }
  return of(std::integral_constant<int, most>());
}

}  // namespace

void TreeGrower::fit_leaf(GrowingNode& leaf, std::span<const int> rows, std::span<const double> shares,
                          const Eigen::VectorXd& residuals) const {
  const int size = static_cast<int>(leaf.model.features.size());
  const RegressorSums leaf_sums = with_size<most_boosted_slopes>(size, [&](auto fixed) {
    const auto sums = [&](auto is_soft, auto is_weighted) {
      return regressor_sums<fixed(), is_soft(), is_weighted()>(leaf.model, rows_, rows, shares, residuals);
    };
    using std::false_type;
    using std::true_type;
    if (rows_.equal_weights) return shares.empty() ? sums(false_type(), false_type()) : sums(true_type(), false_type());
    return shares.empty() ? sums(false_type(), true_type()) : sums(true_type(), true_type());
  });
  add_estimate(leaf.model, size, leaf_sums, options_.ridges);
  leaf.model.means = means_of(leaf_sums, leaf.model.features, lacked_);
}

// A leaf without rows keeps its path's model within the range of the rows of the nearest node above.
void TreeGrower::hold_empty(GrowingNode& leaf, const Eigen::VectorXd& residuals) const {
  int above = leaf.parent;
  while (tree_[above].count() == 0) above = tree_[above].parent;
  auto& [constant, low, high, slopes] = static_cast<LeafModel&>(leaf.model);
  low = std::numeric_limits<double>::infinity();
  high = -low;
  for (Eigen::Index k = tree_[above].begin; k < tree_[above].end; ++k) {
    low = std::min(low, residuals(order_[k]));
    high = std::max(high, residuals(order_[k]));
  }
}

void TreeGrower::fit_leaves(const Eigen::VectorXd& residuals) {
  is_soft_ = is_soft(tree_);
  if (is_soft_) share_rows();
  parallel_for(std::ssize(tree_), max_threads_, [&](Eigen::Index k) {
    if (tree_[k].feature >= 0) return;
    const auto [rows, shares] = rows_in(tree_, static_cast<int>(k));
    if (rows.empty()) {
      hold_empty(tree_[k], residuals);
    } else {
      fit_leaf(tree_[k], rows, shares, residuals);
    }
  });
}

TreeGrower::RowsInLeaf TreeGrower::rows_in(const GrowingTree& tree, int leaf) const {
  if (is_soft_) return {soft_rows_[leaf].of_rows(), soft_rows_[leaf].of_shares()};
  return {std::span(order_).subspan(tree[leaf].begin, tree[leaf].count()), {}};
}

void TreeGrower::subtract_last(const GrowingTree& tree, double rate, Eigen::VectorXd& residuals) const {
  const auto subtract = [&](Eigen::Index k) {
    if (tree[k].feature >= 0) return;
    const GrowingNode& leaf = tree[k];
    const auto [rows, shares] = rows_in(tree, static_cast<int>(k));
    with_size<most_boosted_slopes>(static_cast<int>(leaf.model.features.size()), [&](auto size) {
      const PathValues<size()> model(leaf.model, rows_);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const double value = std::clamp(model.at(rows[i]), leaf.model.low, leaf.model.high);
        residuals(rows[i]) -= rate * (shares.empty() ? value : shares[i] * value);
      }
    });
  };
  // A row is in one leaf of a crisp tree, and may be in several of a soft one.
  parallel_for(std::ssize(tree), is_soft_ ? 1 : max_threads_, subtract);
  const RowBlocks blocks{residuals.size() - count_};
  parallel_for(blocks.count(), max_threads_, [&](Eigen::Index block) {
    for (Eigen::Index k = blocks[block].begin; k < blocks[block].end; ++k) {
      residuals(count_ + k) -= rate * value_at(tree, rows_, count_ + k);
    }
  });
}

double value_at(const GrowingTree& tree, const BinnedRows& rows, Eigen::Index row) {
  double sum = 0.0;
  visit(tree, rows, row, 0, 1.0, [&](int leaf, double share) {
    const PathModel& model = tree[leaf].model;
    sum += share * std::clamp(model.at(rows, row), model.low, model.high);
  });
  return sum;
}

BoostedTree finished(const GrowingTree& tree, const BinnedRows& rows) {
  BoostedTree result;
  std::vector<int> number(tree.size(), 0);
  for (std::size_t k = 0; k < tree.size(); ++k) {
    const GrowingNode& node = tree[k];
    if (node.feature >= 0) {
      number[k] = static_cast<int>(result.splits.size());
      result.splits.push_back({node.feature, rows.features[node.feature].edges[node.cell], node.half_width,
                               rounded_stand_in(node.missing_left), 0, 0});
    } else {
      number[k] = -1 - static_cast<int>(result.leaves.size());
      const PathModel& model = node.model;
      result.leaves.push_back({.constant = model.constant,
                               .low = model.low,
                               .high = model.high,
                               .features = {model.features.begin(), model.features.end()},
                               .slopes = {model.slopes.begin(), model.slopes.begin() + model.features.size()},
                               .means = {}});
      for (std::size_t j = 0; j < model.features.size(); ++j) {
        result.leaves.back().means.push_back(rounded_stand_in(model.means[j]));
      }
    }
  }
  for (std::size_t k = 0; k < tree.size(); ++k) {
    if (tree[k].feature < 0) continue;
    BoostedSplit& split = result.splits[number[k]];
    split.left = number[tree[k].left];
    split.right = number[tree[k].right];
  }
  return result;
}

}  // namespace llmt
