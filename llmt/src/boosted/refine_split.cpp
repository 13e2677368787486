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

TreeGrower::Choice TreeGrower::refined(std::span<const int> leaves, Choice choice) const {
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
    SideSums all;
    SideSums left;
    const std::uint16_t* const cells = column.cells.data();
    const float* const values = column.values.data();
    const int missing_at = choice.missing_left ? -1 : missing_cell;  // before or behind all cells
    for (Eigen::Index k = node.begin; k < node.end; ++k) {
      const int row = order_[k];
      const int cell = cells[row] == missing_cell ? missing_at : cells[row];
      const double w = weights_[k];
      const double z = values[row];
      all.add(w, residuals_[k], z);
      left.add(cell < first ? w : 0.0, residuals_[k], z);  // without a branch, which no processor could foresee
      if (cell >= first && cell <= last) of_leaf[i].push_back({cell, static_cast<int>(i), w, residuals_[k], z});
    }
    of_this.all = all;
    of_this.left = left;
    of_this.slope = may_have_slope(node, choice.feature);
    of_this.gain = of_this.gain_of_sides(options_.ridges);
  });
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
