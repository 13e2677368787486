#include "boosted/refine_split.hpp"

#include <algorithm>

#include "base/parallel.hpp"

namespace llmt {
namespace {

double gain_of(const SumsOfLeaf& leaf, const Ridges& ridges) {
  return side_gain(leaf.left, ridges, leaf.slope) + side_gain(leaf.all - leaf.left, ridges, leaf.slope);
}

}  // namespace

Window window_of(const BinnedFeature& feature, const SplitChoice& choice) {
  const auto bin = std::ranges::lower_bound(feature.last_cells, choice.cell);
  return {bin == feature.last_cells.begin() ? 0 : *(bin - 1) + 1, *(bin + 1)};
}

SplitChoice best_of_window(std::vector<RowOfWindow> window, std::vector<SumsOfLeaf> leaves, const Ridges& ridges,
                           SplitChoice choice) {
  std::vector<double> gains;
  double gain = 0.0;
  for (const SumsOfLeaf& leaf : leaves) {
    gains.push_back(gain_of(leaf, ridges));
    gain += gains.back();
  }
  std::ranges::stable_sort(window, {}, &RowOfWindow::cell);
  double best = 0.0;
  for (std::size_t k = 0; k + 1 < window.size(); ++k) {
    const RowOfWindow& one = window[k];
    SumsOfLeaf& leaf = leaves[one.leaf];
    leaf.left.add(one.weight, one.residual, one.z);
    gain -= gains[one.leaf];
    gains[one.leaf] = gain_of(leaf, ridges);
    gain += gains[one.leaf];
    const int next = window[k + 1].cell;
    if (next == one.cell || gain <= best) continue;
    best = gain;
    choice.cell = one.cell + (next - 1 - one.cell) / 2;  // halfway if held-out rows lie between
  }
  return choice;
}

SplitChoice TreeGrower::refined(std::span<const int> leaves, SplitChoice choice) {
  const BinnedFeature& column = rows_.features[choice.feature];
  const Window window = window_of(column, choice);
  if (window.last - window.first < 2) return choice;
  std::vector<SumsOfLeaf> sums(leaves.size());
  std::vector<std::vector<RowOfWindow>> of_leaf(leaves.size());
  parallel_for(std::ssize(leaves), max_threads_, [&](Eigen::Index i) {
    const GrowingNode& node = tree_[leaves[i]];
    gather(node, choice.feature);
    if (column.has_missing) {  // their cell lies before all others, or behind them
      const int missing_at = choice.missing_left == 1.0 ? -1 : missing_cell;
      for (Eigen::Index k = node.begin; k < node.end; ++k) {
        if (cells_[k] == missing_cell) cells_[k] = missing_at;
      }
    }
    const auto [all, left] =
        sum_sides(rows_of(node), std::span(cells_).subspan(node.begin, node.count()), window.first);
    sums[i] = {all, left, may_have_slope(node, choice.feature)};
    int* const found = spare_order_.data() + node.begin;  // has nothing now in the places of these rows
    Eigen::Index count = 0;
    for (int k = static_cast<int>(node.begin); k < node.end; ++k) {
      found[count] = k;
      count += window.has(cells_[k]) ? 1 : 0;
    }
    of_leaf[i].reserve(count);
    for (Eigen::Index n = 0; n < count; ++n) {
      const int k = found[n];
      of_leaf[i].push_back({cells_[k], static_cast<int>(i), weights_[k], residuals_[k], values_[k]});
    }
  });
  is_gathered_ = true;
  std::vector<RowOfWindow> rows;
  for (const std::vector<RowOfWindow>& some : of_leaf) rows.insert(rows.end(), some.begin(), some.end());
  return best_of_window(std::move(rows), std::move(sums), options_.ridges, choice);
}

}  // namespace llmt
