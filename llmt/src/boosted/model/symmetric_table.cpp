#include "boosted/model/symmetric_table.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <type_traits>

#include "base/simd.hpp"

namespace llmt {
namespace {

constexpr std::size_t most_levels = 8;  // what boosting grows has at most six

// Finds the levels from `at` downwards. False if the splits of one differ, are soft, or are too many.
bool find_levels(SymmetricTable& table, const BoostedTree& tree, int at, std::size_t level) {
  if (at < 0) return true;
  const BoostedSplit& split = tree.splits[at];
  if (level == most_levels || split.half_width > 0.0) return false;
  if (level == table.levels.size()) table.levels.push_back({split.feature, split.threshold, split.missing_left == 1.0});
  const SymmetricTable::Level& here = table.levels[level];
  if (split.feature != here.feature || split.threshold != here.threshold) return false;
  if (split.missing_left != (here.missing_left ? 1.0 : 0.0)) table.needed.push_back(split.feature);
  return find_levels(table, tree, split.left, level + 1) && find_levels(table, tree, split.right, level + 1);
}

// Fills the leaves from `first` on that are below `at`, a split at `level` or a leaf.
void fill(SymmetricTable& table, const BoostedTree& tree, int at, std::size_t level, std::size_t first) {
  const std::size_t below = table.leaves.size() >> level;
  if (at >= 0) {
    fill(table, tree, tree.splits[at].left, level + 1, first);
    fill(table, tree, tree.splits[at].right, level + 1, first + below / 2);
    return;
  }
  const BoostedLeaf& leaf = tree.leaves[-1 - at];
  for (std::size_t k = first; k < first + below; ++k) {
    table.leaves[k] = {leaf.constant, leaf.low, leaf.high};
    std::ranges::copy(leaf.slopes, table.slopes.begin() + static_cast<std::ptrdiff_t>(k * leaf.slopes.size()));
  }
  for (std::size_t k = 0; k < leaf.means.size(); ++k) {
    if (leaf.means[k] != 0.0) table.needed.push_back(leaf.features[k]);
  }
}

// A comparison with a missing value (NaN) is false.
LLMT_FOR_EACH_INSTRUCTION_SET
void to_sides(std::int64_t* __restrict leaves, const double* z, double threshold, bool missing_left) {
  if (missing_left) {
    for (int i = 0; i < rows_at_once; ++i) leaves[i] = 2 * leaves[i] + (z[i] > threshold ? 1 : 0);
  } else {
    for (int i = 0; i < rows_at_once; ++i) leaves[i] = 2 * leaves[i] + (z[i] <= threshold ? 0 : 1);
  }
}

template <int slopes>
void add_leaves(const SymmetricTable& table, const std::int64_t* leaves, const double* z, double* values) {
  std::array<const double*, slopes> columns;
  for (int j = 0; j < slopes; ++j) columns[j] = z + static_cast<std::ptrdiff_t>(table.features[j]) * rows_at_once;
  for (int i = 0; i < rows_at_once; ++i) {
    const SymmetricTable::Leaf& leaf = table.leaves[leaves[i]];
    const double* const of_leaf = table.slopes.data() + leaves[i] * slopes;
    double value = leaf.constant;
    for (int j = 0; j < slopes; ++j) value += of_leaf[j] * columns[j][i];
    values[i] += std::clamp(value, leaf.low, leaf.high);
  }
}

// Calls of(size) with the size, up to `most`, as a constant.
template <int most, class Of>
void with_size(std::size_t size, const Of& of) {
  if constexpr (most > 0) {
    if (size < most) return with_size<most - 1>(size, of);
  }
  of(std::integral_constant<int, most>());
}

}  // namespace

std::optional<SymmetricTable> symmetric_table(const BoostedTree& tree) {
  SymmetricTable table;
  const int root = tree.splits.empty() ? -1 : 0;
  table.features = tree.leaves.front().features;
  const auto has_other_features = [&](const BoostedLeaf& leaf) { return leaf.features != table.features; };
  if (table.features.size() > most_boosted_slopes || std::ranges::any_of(tree.leaves, has_other_features) ||
      !find_levels(table, tree, root, 0)) {
    return std::nullopt;
  }
  table.leaves.resize(std::size_t{1} << table.levels.size());
  table.slopes.resize(table.leaves.size() * table.features.size());
  fill(table, tree, root, 0, 0);
  return table;
}

void add_values(const SymmetricTable& table, const double* z, const double* in_slopes, double* values) {
  std::array<std::int64_t, rows_at_once> leaves = {};
  for (const auto [feature, threshold, missing_left] : table.levels) {
    to_sides(leaves.data(), z + static_cast<std::ptrdiff_t>(feature) * rows_at_once, threshold, missing_left);
  }
  with_size<most_boosted_slopes>(table.features.size(),
                                 [&](auto size) { add_leaves<size()>(table, leaves.data(), in_slopes, values); });
}

}  // namespace llmt
