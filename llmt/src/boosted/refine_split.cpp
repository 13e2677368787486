// A split that was found between bins is moved to the best of the cells next to it.
#include <algorithm>

#include "base/parallel.hpp"
#include "boosted/growing_tree.hpp"

namespace llmt {
namespace {

struct RowOfWindow {
  int cell = 0;
  int leaf = 0;
  double weight = 0.0;
  double residual = 0.0;
  double z = 0.0;
};

struct SumsOfLeaf {
  SideSums all;
  SideSums left;
  bool slope = false;
  double gain = 0.0;

  double gain_of_sides(const Ridges& ridges) const {
    return side_gain(left, ridges, slope) + side_gain(all - left, ridges, slope);
  }
};

}  // namespace

TreeGrower::Choice TreeGrower::refined(std::span<const int> leaves, Choice choice) {
  const BinnedFeature& column = rows_.features[choice.feature];
  // The window has the bins on both sides of the split.
  const auto bin = std::ranges::lower_bound(column.last_cells, choice.cell);
  const int first = bin == column.last_cells.begin() ? 0 : *(bin - 1) + 1;
  const int last = *(bin + 1);
  if (last - first < 2) return choice;
  std::vector<SumsOfLeaf> sums(leaves.size());
  std::vector<std::vector<RowOfWindow>> of_leaf(leaves.size());
  parallel_for(std::ssize(leaves), max_threads_, [&](Eigen::Index i) {
    const GrowingNode& node = tree_[leaves[i]];
    SumsOfLeaf& of_this = sums[i];
    gather(node, choice.feature);
    if (column.has_missing) {  // their cell lies before all others, or behind them
      const int missing_at = choice.missing_left ? -1 : missing_cell;
      for (Eigen::Index k = node.begin; k < node.end; ++k) {
        if (cells_[k] == missing_cell) cells_[k] = missing_at;
      }
    }
    const auto [all, left] = sum_sides(rows_of(node), std::span(cells_).subspan(node.begin, node.count()), first);
    int* const found = spare_order_.data() + node.begin;  // has nothing now in the places of these rows
    const int* const cells = cells_.data();
    Eigen::Index count = 0;
    for (int k = static_cast<int>(node.begin); k < node.end; ++k) {
      found[count] = k;
      count += static_cast<unsigned>(cells[k] - first) <= static_cast<unsigned>(last - first) ? 1 : 0;
    }
    of_leaf[i].reserve(count);
    for (Eigen::Index n = 0; n < count; ++n) {
      const int k = found[n];
      of_leaf[i].push_back({cells_[k], static_cast<int>(i), weights_[k], residuals_[k], values_[k]});
    }
    of_this.all = all;
    of_this.left = left;
    of_this.slope = may_have_slope(node, choice.feature);
    of_this.gain = of_this.gain_of_sides(options_.ridges);
  });
  is_gathered_ = true;
  std::vector<RowOfWindow> window;
  double gain = 0.0;
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    window.insert(window.end(), of_leaf[i].begin(), of_leaf[i].end());
    gain += sums[i].gain;
  }
  std::ranges::stable_sort(window, {}, &RowOfWindow::cell);
  double best = 0.0;
  for (std::size_t k = 0; k + 1 < window.size(); ++k) {
    const RowOfWindow& one = window[k];
    SumsOfLeaf& of_leaf_of_row = sums[one.leaf];
    of_leaf_of_row.left.add(one.weight, one.residual, one.z);
    gain -= of_leaf_of_row.gain;
    of_leaf_of_row.gain = of_leaf_of_row.gain_of_sides(options_.ridges);
    gain += of_leaf_of_row.gain;
    const int next = window[k + 1].cell;
    if (next == one.cell || gain <= best) continue;
    best = gain;
    choice.cell = one.cell + (next - 1 - one.cell) / 2;  // halfway if held-out rows lie between
  }
  return choice;
}

}  // namespace llmt
