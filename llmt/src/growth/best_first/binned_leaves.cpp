#include "growth/best_first/binned_leaves.hpp"

#include <algorithm>

namespace llmt {
namespace {

// Histograms of waiting leaves may take a quarter of the memory of the features, and at least the memory of the
// histograms of eight nodes.
constexpr Eigen::Index kept_part = 4;
constexpr Eigen::Index kept_nodes = 8;

// In doubles, 128 MiB: about 100 inputs. A search holds three of them, besides those that wait.
constexpr Eigen::Index largest_histogram = Eigen::Index{1} << 24;

}  // namespace

bool BinnedLeaves::possible(const GrowthData& data) {
  if (BinnedRows::largest_histogram(data) > largest_histogram) return false;
  const bool few_levels = std::ranges::all_of(data.num_levels, [](int levels) { return levels <= most_bins; });
  return few_levels && is_complete(data);
}

BinnedLeaves::BinnedLeaves(const GrowthData& data)
    : data_(data),
      rows_(data),
      memory_left_(std::max(rows_.whitened().features().rows() * rows_.whitened().features().columns() / kept_part,
                            kept_nodes * rows_.size_of_histogram())) {}

BinnedLeaf BinnedLeaves::root() const {
  BinnedLeaf leaf{whitened_root(data_), {}};
  leaf.histogram = rows_.accumulate(leaf.rows);
  return leaf;
}

SplitCandidate BinnedLeaves::examine(BinnedLeaf& leaf, const Node& parent, Node& node, double& excess) {
  if (!leaf.histogram) {
    leaf.histogram = rows_.accumulate(leaf.rows);
  }
  std::vector<double> gram = rows_.total(*leaf.histogram);
  fit_whitened(data_, rows_.whitened(), gram, parent, leaf, node);
  if (refreshed(data_, rows_.whitened(), gram, node, leaf)) {
    leaf.histogram = rows_.accumulate(leaf.rows);
    gram = rows_.total(*leaf.histogram);
    fit_whitened(data_, rows_.whitened(), gram, parent, leaf, node);
  }
  return rows_.search(*leaf.histogram, leaf.rows, data_.output_weights.dot(node.rss), node.rank, excess);
}

void BinnedLeaves::wait(BinnedLeaf& leaf) {
  if (!leaf.histogram) return;
  if (rows_.size_of_histogram() <= memory_left_) {
    memory_left_ -= rows_.size_of_histogram();
  } else {
    leaf.histogram.reset();
  }
}

std::array<BinnedLeaf, 2> BinnedLeaves::divide(BinnedLeaf& leaf, const SplitCandidate& split) {
  std::array<BinnedLeaf, 2> children;
  children[0].rows.resize(split.left);
  children[1].rows.resize(leaf.rows.size() - split.left);
  std::array<int*, 2> next = {children[1].rows.data(), children[0].rows.data()};
  for (const int row : leaf.rows) {
    *next[rows_.goes_left(row, split) ? 1 : 0]++ = row;
  }
  for (BinnedLeaf& child : children) {
    child.value = leaf.value;
    child.slope = leaf.slope;
  }
  if (leaf.histogram) {
    memory_left_ += rows_.size_of_histogram();
    const std::size_t small = children[0].rows.size() <= children[1].rows.size() ? 0 : 1;
    children[small].histogram = rows_.accumulate(children[small].rows);
    subtract(*children[small].histogram, *leaf.histogram);
    children[1 - small].histogram = std::move(leaf.histogram);
  }
  return children;
}

double BinnedLeaves::threshold(const BinnedLeaf& leaf, const SplitCandidate& split, const Node& node, const Node& left,
                               const Node& right) const {
  const auto [low, high] = rows_.gap(leaf.rows, split);
  return place_threshold(data_, leaf, split.input, low, high, node, left, right);
}

}  // namespace llmt
