#include "boosted/growing_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace llmt {

TreeGrower::TreeGrower(const BinnedRows& rows, Eigen::Index count, TreeOptions options, int max_threads)
    : rows_(rows), count_(count), options_(options), max_threads_(max_threads), lacked_(lacked_features(rows, count)) {}

void TreeGrower::begin(const Eigen::VectorXd& residuals) {
  order_.resize(count_);
  std::iota(order_.begin(), order_.end(), 0);
  residuals_.resize(order_.size());
  weights_.resize(order_.size());
  terms_.resize(order_.size());
  values_.resize(order_.size());
  cells_.resize(order_.size());
  spare_order_.resize(order_.size());
  spare_values_.resize(order_.size());
  spare_residuals_.resize(order_.size());
  spare_weights_.resize(order_.size());
  double weight = 0.0;
  double sum = 0.0;
  for (std::size_t k = 0; k < order_.size(); ++k) {
    weights_[k] = rows_.weights(order_[k]);
    weight += weights_[k];
    sum += weights_[k] * residuals(order_[k]);
  }
  GrowingNode root;
  root.end = std::ssize(order_);
  root.model.constant = sum / weight;
  for (std::size_t k = 0; k < order_.size(); ++k) residuals_[k] = residuals(order_[k]) - root.model.constant;
  if (is_searching_) {
    units_ = units_of(residuals_, weights_, rows_.equal_weights);
    pack(root);
  }
  tree_ = {root};
}

void TreeGrower::pack(const GrowingNode& node) {
  const std::size_t count = node.count();
  pack_rows(std::span(residuals_).subspan(node.begin, count), std::span(weights_).subspan(node.begin, count), units_,
            std::span(terms_).subspan(node.begin, count));
}

void TreeGrower::gather(const GrowingNode& node, int feature) {
  const std::uint16_t* const cells = rows_.features[feature].cells.data();
  const float* const values = rows_.features[feature].values.data();
  for (Eigen::Index k = node.begin; k < node.end; ++k) {
    cells_[k] = cells[order_[k]];
    values_[k] = values[order_[k]];
  }
}

RowsInOrder TreeGrower::rows_of(const GrowingNode& node) const {
  const std::size_t count = node.count();
  return {std::span(weights_).subspan(node.begin, count), std::span(residuals_).subspan(node.begin, count),
          std::span(values_).subspan(node.begin, count)};
}

std::vector<int> some_features(std::size_t all, double share, Random& random) {
  const auto some = static_cast<std::size_t>(std::ceil(share * static_cast<double>(all)));
  std::vector<int> result;
  for (const Eigen::Index feature : random.permutation(static_cast<Eigen::Index>(all))) {
    if (result.size() < some) result.push_back(static_cast<int>(feature));
  }
  std::ranges::sort(result);
  return result;
}

std::vector<bool> lacked_features(const BinnedRows& rows, Eigen::Index count) {
  std::vector<bool> lacked;
  for (std::size_t k = 0; k < rows.features.size(); ++k) {
    const auto cells = std::span(rows.features[k].cells).first(count);
    lacked.push_back(rows.features[k].has_missing && std::ranges::find(cells, missing_cell) != cells.end());
  }
  return lacked;
}

Slopes means_of(const RegressorSums& sums, const SlopeFeatures& features, const std::vector<bool>& lacked) {
  Slopes means = {};
  for (std::size_t k = 0; k < features.size(); ++k) means[k] = lacked[features[k]] ? 0.0 : sums.z[k] / sums.n;
  return means;
}

FeatureGains::FeatureGains(const BinnedRows& rows, int feature) : feature_(feature), column_(&rows.features[feature]) {
  for (Gains& gains : gains_) gains.fill(0.0);
}

void FeatureGains::add(const Histogram& histogram, const PackedUnits& units, const Ridges& ridges, bool slopes) {
  has_missing_ = has_missing_ || histogram[missing_bin] != 0;
  add_gains(gains_[0], *column_, histogram, units, ridges, slopes, false);
  if (column_->has_missing) add_gains(gains_[1], *column_, histogram, units, ridges, slopes, true);
}

SplitChoice FeatureGains::best() const {
  SplitChoice best;
  for (const int missing_left : {0, 1}) {
    if (missing_left == 1 && !has_missing_) continue;
    for (int t = 0; t + 1 < column_->num_bins(); ++t) {
      best.take_if_better({gains_[missing_left][t], feature_, column_->last_cells[t],
                           has_missing_ ? missing_left : SplitChoice::undecided});
    }
  }
  return best;
}

bool TreeGrower::may_have_slope(const GrowingNode& node, int feature) const {
  return std::ssize(node.model.features) < options_.slopes || std::ranges::count(node.model.features, feature) > 0;
}

SplitChoice TreeGrower::best_of_features(std::span<const int> leaves, std::span<const int> features) const {
  std::array<FeatureGains, features_at_once> gains;
  std::array<Histogram, features_at_once> sums;
  std::array<HistogramOf, features_at_once> histograms;
  for (std::size_t k = 0; k < features.size(); ++k) {
    gains[k] = FeatureGains(rows_, features[k]);
    histograms[k] = {rows_.features[features[k]].bins.data(), &sums[k]};
  }
  for (const int leaf : leaves) {
    const GrowingNode& node = tree_[leaf];
    if (node.count() == 0) continue;
    for (Histogram& histogram : sums) histogram.fill(0);
    add_to(std::span(histograms).first(features.size()), std::span(order_).subspan(node.begin, node.count()),
           std::span(terms_).subspan(node.begin, node.count()));
    for (std::size_t k = 0; k < features.size(); ++k) {
      gains[k].add(sums[k], units_, options_.ridges, may_have_slope(node, features[k]));
    }
  }
  SplitChoice best;
  for (std::size_t k = 0; k < features.size(); ++k) best.take_if_better(gains[k].best());
  return best;
}

SplitChoice TreeGrower::best_split(std::span<const int> leaves, Random& random) const {
  return best_of_all(some_features(rows_.features.size(), options_.columns, random), max_threads_,
                     [&](std::span<const int> some) { return best_of_features(leaves, some); });
}

void TreeGrower::split_rows(int index) {
  GrowingNode& node = tree_[index];
  const bool has_weights = !rows_.equal_weights;
  const bool missing_left = node.missing_left >= 0.5;
  const auto is_lacking = [](int cell) { return cell == missing_cell || cell < 0; };
  const bool is_decided =
      lacked_[node.feature] && std::any_of(cells_.begin() + node.begin, cells_.begin() + node.end, is_lacking);
  // Rows of the right side wait in the same places of the spare lists: other nodes have other places.
  Eigen::Index left = node.begin;
  Eigen::Index right = node.begin;
  for (Eigen::Index k = node.begin; k < node.end; ++k) {
    const int cell = cells_[k];
    const bool is_left = cell == missing_cell ? missing_left : cell <= node.cell;  // -1: missing too
    spare_order_[right] = order_[left] = order_[k];
    spare_values_[right] = values_[left] = values_[k];
    spare_residuals_[right] = residuals_[left] = residuals_[k];
    if (has_weights) spare_weights_[right] = weights_[left] = weights_[k];
    left += is_left ? 1 : 0;
    right += is_left ? 0 : 1;
  }
  std::copy(spare_order_.begin() + node.begin, spare_order_.begin() + right, order_.begin() + left);
  std::copy(spare_values_.begin() + node.begin, spare_values_.begin() + right, values_.begin() + left);
  std::copy(spare_residuals_.begin() + node.begin, spare_residuals_.begin() + right, residuals_.begin() + left);
  if (has_weights) {
    std::copy(spare_weights_.begin() + node.begin, spare_weights_.begin() + right, weights_.begin() + left);
  }
  GrowingNode& l = tree_[node.left];
  GrowingNode& r = tree_[node.right];
  l.begin = node.begin;
  l.end = r.begin = left;
  r.end = node.end;
  const double weight = weight_of(node);
  if (is_decided) {
    node.missing_left = missing_left ? 1.0 : 0.0;
  } else if (weight > 0.0) {
    node.missing_left = weight_of(l) / weight;
  }
}

double TreeGrower::weight_of(const GrowingNode& node) const {
  if (rows_.equal_weights) return static_cast<double>(node.count());
  return std::accumulate(weights_.begin() + node.begin, weights_.begin() + node.end, 0.0);
}

// The constant and the slope in the split's feature that the side's residuals ask for.
void TreeGrower::add_to_path(GrowingNode& side, int feature) {
  const bool has_slope = may_have_slope(side, feature);
  const SideSums sums = sum_rows(rows_of(side));
  if (sums.weight == 0.0) return;
  const auto [constant, slope] = side_model(sums, has_slope, options_.ridges);
  side.model.constant += constant;
  if (has_slope) {
    const auto found = std::ranges::find(side.model.features, feature);
    double& of_feature = side.model.slopes[found - side.model.features.begin()];
    if (found == side.model.features.end()) {
      side.model.features.push_back(feature);
      of_feature = slope;
    } else {
      of_feature += slope;
    }
  }
  for (Eigen::Index k = side.begin; k < side.end; ++k)
    residuals_[k] -= constant + slope * static_cast<double>(values_[k]);
  if (is_searching_) pack(side);
}

void TreeGrower::split(std::span<const int> leaves, std::span<const SplitChoice> choices) {
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    GrowingNode child;
    child.parent = leaves[k];
    child.model = tree_[leaves[k]].model;
    GrowingNode& node = tree_[leaves[k]];
    node.feature = choices[k].feature;
    node.cell = choices[k].cell;
    node.missing_left = choices[k].missing_left;
    node.left = static_cast<int>(tree_.size());
    node.right = node.left + 1;
    tree_.push_back(child);
    tree_.push_back(child);
  }
  const bool is_gathered = std::exchange(is_gathered_, false);
  parallel_for(std::ssize(leaves), max_threads_, [&](Eigen::Index k) {
    if (!is_gathered) gather(tree_[leaves[k]], choices[k].feature);
    split_rows(leaves[k]);
    GrowingNode& node = tree_[leaves[k]];
    add_to_path(tree_[node.left], node.feature);
    add_to_path(tree_[node.right], node.feature);
    if (options_.softness > 0.0) {
      const double half_width = half_width_of(leaves[k]);
      if (half_width > 0.0 && blends_well(leaves[k], half_width)) node.half_width = half_width;
    }
  });
}

void TreeGrower::grow_symmetric(Random& random) {
  std::vector<int> leaves = {0};
  for (int level = 0; level < options_.depth; ++level) {
    const SplitChoice best = best_split(leaves, random);
    is_searching_ = level + 1 < options_.depth;
    if (best.feature < 0) continue;
    std::vector<int> with_rows;
    for (const int leaf : leaves) {
      if (tree_[leaf].count() > 0) with_rows.push_back(leaf);
    }
    split(with_rows, std::vector<SplitChoice>(with_rows.size(), refined(with_rows, best)));
    leaves.clear();
    for (const int node : with_rows) leaves.insert(leaves.end(), {tree_[node].left, tree_[node].right});
  }
}

void TreeGrower::grow_free(Random& random) {
  std::vector<SplitChoice> best_of(1);
  const auto look = [&](int leaf) { best_of[leaf] = best_split(std::vector<int>{leaf}, random); };
  look(0);
  for (int leaves = 1; leaves < options_.leaves; ++leaves) {
    const auto best = std::ranges::max_element(best_of, {}, &SplitChoice::gain);
    if (best->feature < 0) return;
    const int leaf = static_cast<int>(best - best_of.begin());
    split(std::vector<int>{leaf}, std::vector<SplitChoice>{refined(std::vector<int>{leaf}, *best)});
    best_of[leaf] = {};
    best_of.resize(tree_.size());
    if (leaves + 1 == options_.leaves) return;
    const GrowingNode& node = tree_[leaf];
    for (const int child : {node.left, node.right}) {
      if (static_cast<double>(tree_[child].count()) >= 2.0 * options_.fewest) look(child);
    }
  }
}

GrowingTree TreeGrower::grow(const Eigen::VectorXd& residuals, Random& random) {
  is_searching_ = true;
  begin(residuals);
  if (options_.symmetric) {
    grow_symmetric(random);
  } else {
    grow_free(random);
  }
  fit_leaves(residuals);
  return std::move(tree_);
}

GrowingTree TreeGrower::estimate(const GrowingTree& tree, const Eigen::VectorXd& residuals) {
  is_searching_ = false;
  begin(residuals);
  // A split comes after the one above it, so the nodes are numbered anew in the same order.
  std::vector<int> number(tree.size(), 0);
  for (std::size_t k = 0; k < tree.size(); ++k) {
    if (tree[k].feature < 0) continue;
    split(std::vector<int>{number[k]},
          std::vector<SplitChoice>{{0.0, tree[k].feature, tree[k].cell, tree[k].missing_left}});
    const GrowingNode& node = tree_[number[k]];
    number[tree[k].left] = node.left;
    number[tree[k].right] = node.right;
  }
  fit_leaves(residuals);
  return std::move(tree_);
}

}  // namespace llmt
