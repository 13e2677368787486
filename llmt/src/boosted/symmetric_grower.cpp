#include "boosted/symmetric_grower.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include "base/parallel.hpp"
#include "base/simd.hpp"
#include "base/sum_over.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index block_of_search = 8192;

void add_to_leaves(const std::array<HistogramOf, features_at_once>& histograms, std::size_t features,
                   const std::uint8_t* leaves, const PackedSum* terms, std::size_t count) {
  const auto [bins, sums] = histograms[0];
  const auto [other_bins, other_sums] = histograms[1];
  if (features == features_at_once) {
    for (std::size_t k = 0; k < count; ++k) {
      const PackedSum term = terms[k];
      sums[leaves[k]][bins[k]] += term;
      other_sums[leaves[k]][other_bins[k]] += term;
    }
    return;
  }
  for (std::size_t k = 0; k < count; ++k) sums[leaves[k]][bins[k]] += terms[k];
}

// The rows of a leaf below a window of cells, in it and above it.
enum Region { below, within, above, num_regions };

// Of one leaf and region; whole lines of memory.
struct RegionSums {
  SideSums sums = {};
  std::array<double, 3> unused = {};

  RegionSums& operator+=(const RegionSums& other) {
    sums = sums + other.sums;
    return *this;
  }
};

struct SumsOfRegions {
  std::vector<RegionSums> sums;  // of each leaf three
  std::vector<int> in_window;    // rows

  SumsOfRegions& operator+=(const SumsOfRegions& next) {
    for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += next.sums[k];
    in_window.insert(in_window.end(), next.in_window.begin(), next.in_window.end());
    return *this;
  }
};

struct ColumnOfRows {
  const std::uint16_t* cells;
  const float* values;
  const double* weights;
};

// Cells beyond the last one are those of missing values, which the left side may have.
LLMT_INLINE int region_of(int cell, Window window, bool missing_left) {
  if (missing_left && cell == missing_cell) return below;
  return (cell >= window.first ? 1 : 0) + (cell > window.last ? 1 : 0);
}

LLMT_FOR_EACH_INSTRUCTION_SET
void add_regions(RegionSums* sums, const std::uint8_t* leaves, ColumnOfRows column, const double* residuals,
                 std::size_t count, Window window, bool missing_left) {
  constexpr int turns = 2;  // rows take turns with two sums, so that one need not wait for the other
  std::array<RegionSums, turns* num_regions* most_symmetric_leaves> by_turns = {};
  int most = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const int place = num_regions * leaves[k] + region_of(column.cells[k], window, missing_left);
    most = std::max(most, place);
    const double w = column.weights[k];
    const double z = column.values[k];
    const double e = residuals[k];
    RegionSums& of_place = by_turns[turns * place + static_cast<int>(k % turns)];
    of_place.sums.weight += w;
    add_to_quad(&of_place.sums.residual, Quad{w, w, w * z, w * z} * Quad{e, z, z, e});
  }
  for (int place = 0; place <= most; ++place) {
    for (int turn = 0; turn < turns; ++turn) sums[place] += by_turns[turns * place + turn];
  }
}

// Rows of the block that are in the window, behind those that are there.
void list_window(std::vector<int>& rows, const std::uint16_t* cells, RowSpan block, Window window) {
  const std::size_t before = rows.size();
  rows.resize(before + static_cast<std::size_t>(block.end - block.begin) + 1);
  int* next = rows.data() + before;
  for (Eigen::Index k = block.begin; k < block.end; ++k) {
    *next = static_cast<int>(k);
    next += window.has(cells[k]) ? 1 : 0;
  }
  rows.resize(static_cast<std::size_t>(next - rows.data()));
}

// The rows from `first` on that lack a feature which no row before them lacks.
std::vector<int> lacking_rows(const BinnedRows& rows, Eigen::Index first, const std::vector<bool>& lacked) {
  std::vector<int> lacking;
  for (std::size_t k = 0; k < rows.features.size(); ++k) {
    const BinnedFeature& feature = rows.features[k];
    if (!feature.has_missing || lacked[k]) continue;
    for (Eigen::Index row = first; row < std::ssize(feature.cells); ++row) {
      if (feature.cells[row] == missing_cell) lacking.push_back(static_cast<int>(row));
    }
  }
  std::ranges::sort(lacking);
  const auto repeated = std::ranges::unique(lacking);
  lacking.erase(repeated.begin(), repeated.end());
  return lacking;
}

// One side for the rows of all nodes of a level that lack the feature: that of most rows if no such row was searched.
void decide(SplitChoice& choice, std::span<const SumsOfLeaf> sums) {
  if (choice.missing_left == 0.0 || choice.missing_left == 1.0) return;
  double left = 0.0;
  double all = 0.0;
  for (const SumsOfLeaf& leaf : sums) {
    left += leaf.left.weight;
    all += leaf.all.weight;
  }
  choice.missing_left = 2.0 * left >= all ? 1.0 : 0.0;
}

LLMT_FOR_EACH_INSTRUCTION_SET
void to_sides(std::uint8_t* __restrict leaves, const std::uint16_t* cells, std::size_t count, std::uint16_t cell,
              std::uint16_t missing) {
  for (std::size_t k = 0; k < count; ++k) {
    const int right = static_cast<int>(cells[k] > cell) & static_cast<int>(cells[k] != missing);
    leaves[k] = static_cast<std::uint8_t>(leaves[k] * 2 + right);
  }
}

LLMT_FOR_EACH_INSTRUCTION_SET
void subtract_sides(double* __restrict residuals, const std::uint8_t* leaves, const float* values, std::size_t count,
                    const SideModel* sides) {
  for (std::size_t k = 0; k < count; ++k) {
    const SideModel side = sides[leaves[k]];
    residuals[k] -= side.constant + side.slope * static_cast<double>(values[k]);
  }
}

}  // namespace

SymmetricGrower::SymmetricGrower(const BinnedRows& rows, Eigen::Index count, TreeOptions options, int max_threads)
    : rows_(rows),
      count_(count),
      options_(options),
      max_threads_(max_threads),
      lacked_(lacked_features(rows, count)),
      lacking_(lacking_rows(rows, count, lacked_)) {}

void SymmetricGrower::begin(const Eigen::VectorXd& residuals, bool is_searching) {
  levels_.clear();
  features_ = {};
  const Eigen::Index parts = (count_ - 1) / options_.searched + 1;
  const Eigen::Index part = trees_++ % parts;
  first_ = part * count_ / parts;
  const Eigen::Index count = (part + 1) * count_ / parts - first_;
  leaves_.assign(count, 0);
  const auto of_rows = residuals.segment(first_, count);
  const auto weights = rows_.weights.segment(first_, count);
  const double mean = of_rows.dot(weights) / weights.sum();
  models_ = {LeafModel{.constant = mean}};
  has_rows_ = {true};
  residuals_.resize(count);
  Eigen::Map<Eigen::VectorXd>(residuals_.data(), count) = of_rows.array() - mean;
  if (!is_searching) return;
  terms_.resize(count);
  const std::span<const double> all_weights(weights.data(), count);
  units_ = units_of(residuals_, all_weights, rows_.equal_weights);
  pack_rows(residuals_, all_weights, units_, terms_);
}

SplitChoice SymmetricGrower::best_of_features(std::span<const int> features) const {
  const std::size_t num_leaves = models_.size();
  std::array<std::vector<Histogram>, features_at_once> sums;
  std::array<HistogramOf, features_at_once> histograms;
  for (std::size_t k = 0; k < features.size(); ++k) {
    sums[k].resize(num_leaves);
    for (Histogram& histogram : sums[k]) histogram.fill(0);
    histograms[k] = {rows_.features[features[k]].bins.data() + first_, sums[k].data()};
  }
  add_to_leaves(histograms, features.size(), leaves_.data(), terms_.data(), terms_.size());
  SplitChoice best;
  for (std::size_t k = 0; k < features.size(); ++k) {
    FeatureGains gains(rows_, features[k]);
    for (std::size_t leaf = 0; leaf < num_leaves; ++leaf) {
      if (has_rows_[leaf]) gains.add(sums[k][leaf], units_, options_.ridges, may_have_slope(features[k]));
    }
    best.take_if_better(gains.best());
  }
  return best;
}

bool SymmetricGrower::may_have_slope(int feature) const {
  return std::ssize(features_) < options_.slopes || std::ranges::count(features_, feature) > 0;
}

void SymmetricGrower::split(SplitChoice choice, bool is_refined, bool is_last) {
  const BinnedFeature& feature = rows_.features[choice.feature];
  const ColumnOfRows column{feature.cells.data() + first_, feature.values.data() + first_,
                            rows_.weights.data() + first_};
  Window window{choice.cell + 1, choice.cell};  // empty
  if (is_refined) {
    const Window wide = window_of(feature, choice);
    if (wide.last - wide.first >= 2) window = wide;
  }
  const std::size_t num_leaves = models_.size();
  SumsOfRegions zero;
  zero.sums.resize(num_regions * num_leaves);
  const SumsOfRegions regions = sum_over(
      RowBlocks{std::ssize(leaves_), block_of_search}, max_threads_, zero, [&](RowSpan block, SumsOfRegions& sums) {
        const auto [begin, end] = block;
        const ColumnOfRows of_block{column.cells + begin, column.values + begin, column.weights + begin};
        add_regions(sums.sums.data(), leaves_.data() + begin, of_block, residuals_.data() + begin, end - begin, window,
                    choice.missing_left >= 0.5);
        if (window.first <= window.last) list_window(sums.in_window, column.cells, block, window);
      });
  const bool has_slope = may_have_slope(choice.feature);
  std::vector<SumsOfLeaf> sums(num_leaves);
  for (std::size_t leaf = 0; leaf < num_leaves; ++leaf) {
    const RegionSums* const of_leaf = &regions.sums[num_regions * leaf];
    sums[leaf] = {of_leaf[below].sums + of_leaf[within].sums + of_leaf[above].sums, of_leaf[below].sums, has_slope};
  }
  std::vector<RowOfWindow> in_window;
  for (const int k : regions.in_window) {
    in_window.push_back({column.cells[k], leaves_[k], column.weights[k], residuals_[k], column.values[k]});
  }
  if (!in_window.empty()) choice = best_of_window(in_window, sums, options_.ridges, choice);
  for (const RowOfWindow& row : in_window) {
    if (row.cell <= choice.cell) sums[row.leaf].left.add(row.weight, row.residual, row.z);
  }
  if (lacked_[choice.feature]) decide(choice, sums);
  const auto found = std::ranges::find(features_, choice.feature);
  const std::ptrdiff_t slope = found - features_.begin();
  if (has_slope && found == features_.end()) features_.push_back(choice.feature);
  std::vector<SideModel> sides;
  std::vector<LeafModel> models;
  std::vector<bool> has_rows;
  Level level{choice, {}};
  for (std::size_t leaf = 0; leaf < num_leaves; ++leaf) {
    const bool is_shared = !lacked_[choice.feature] && sums[leaf].all.weight > 0.0;
    level.left.push_back(is_shared ? sums[leaf].left.weight / sums[leaf].all.weight : choice.missing_left);
    for (const SideSums& side : {sums[leaf].left, sums[leaf].all - sums[leaf].left}) {
      has_rows.push_back(side.weight > 0.0);
      sides.push_back(has_rows.back() ? side_model(side, has_slope, options_.ridges) : SideModel());
      models.push_back(models_[leaf]);
      models.back().constant += sides.back().constant;
      if (has_slope) models.back().slopes[slope] += sides.back().slope;
    }
  }
  models_ = std::move(models);
  has_rows_ = std::move(has_rows);
  levels_.push_back(std::move(level));
  if (!is_last) move_rows(choice, sides, is_refined);
}

void SymmetricGrower::move_rows(const SplitChoice& level, std::span<const SideModel> sides, bool is_packed) {
  const BinnedFeature& feature = rows_.features[level.feature];
  const RowBlocks blocks{std::ssize(leaves_), block_of_search};
  parallel_for(blocks.count(), max_threads_, [&](Eigen::Index block) {
    const auto [begin, end] = blocks[block];
    const std::size_t count = end - begin;
    // No cell has the number 65535 if missing values are not on the left side: it is on the right one.
    to_sides(leaves_.data() + begin, feature.cells.data() + first_ + begin, count,
             static_cast<std::uint16_t>(level.cell), level.missing_left >= 0.5 ? missing_cell : 0);
    subtract_sides(residuals_.data() + begin, leaves_.data() + begin, feature.values.data() + first_ + begin, count,
                   sides.data());
    if (!is_packed) return;
    pack_rows(std::span(residuals_).subspan(begin, count), {rows_.weights.data() + first_ + begin, count}, units_,
              std::span(terms_).subspan(begin, count));
  });
}

GrowingTree SymmetricGrower::grow(const Eigen::VectorXd& residuals, Random& random) {
  begin(residuals, true);
  for (int level = 0; level < options_.depth; ++level) {
    const SplitChoice best = best_of_all(some_features(rows_.features.size(), options_.columns, random), max_threads_,
                                         [&](std::span<const int> some) { return best_of_features(some); });
    if (best.feature >= 0) split(best, true, level + 1 == options_.depth);
  }
  fit_leaves(residuals);
  return tree();
}

GrowingTree SymmetricGrower::estimate(const GrowingTree& tree, const Eigen::VectorXd& residuals) {
  begin(residuals, false);
  // All nodes of a level have its split, except those without rows.
  std::vector<SplitChoice> choices;
  std::vector<std::size_t> depth(tree.size(), 0);
  for (std::size_t k = 0; k < tree.size(); ++k) {
    const GrowingNode& node = tree[k];
    if (node.feature < 0) continue;
    depth[node.left] = depth[node.right] = depth[k] + 1;
    if (depth[k] < choices.size()) continue;
    choices.push_back({0.0, node.feature, node.cell});
    if (lacked_[node.feature]) choices.back().missing_left = node.missing_left >= 0.5 ? 1.0 : 0.0;
  }
  for (std::size_t level = 0; level < choices.size(); ++level) {
    split(choices[level], false, level + 1 == choices.size());
  }
  fit_leaves(residuals);
  return this->tree();
}

// The leaves of rows from `first` on.
void SymmetricGrower::leaves_of_rows(Eigen::Index first, std::span<std::uint8_t> leaves) const {
  std::ranges::fill(leaves, 0);
  for (const auto& [split, left] : levels_) {
    to_sides(leaves.data(), rows_.features[split.feature].cells.data() + first, leaves.size(),
             static_cast<std::uint16_t>(split.cell), split.missing_left >= 0.5 ? missing_cell : 0);
  }
}

GrowingTree SymmetricGrower::tree() const {
  GrowingTree result;
  add_node(result, 0, 0);
  return result;
}

// Adds the node that has the leaves from `first` on, `models_.size() >> level` of them.
int SymmetricGrower::add_node(GrowingTree& tree, std::size_t level, std::size_t first) const {
  const std::size_t leaves = models_.size() >> level;
  const int number = static_cast<int>(tree.size());
  tree.emplace_back();
  const auto begin = has_rows_.begin() + static_cast<std::ptrdiff_t>(first);
  if (level == levels_.size() || std::find(begin, begin + static_cast<std::ptrdiff_t>(leaves), true) ==
                                     begin + static_cast<std::ptrdiff_t>(leaves)) {
    tree.back().model = {models_[first], features_, means_[first]};
    return number;
  }
  const int left = add_node(tree, level + 1, first);
  const int right = add_node(tree, level + 1, first + leaves / 2);
  GrowingNode& node = tree[number];
  node.feature = levels_[level].split.feature;
  node.cell = levels_[level].split.cell;
  node.missing_left = levels_[level].left[first / leaves];
  node.left = left;
  node.right = right;
  return number;
}

}  // namespace llmt
