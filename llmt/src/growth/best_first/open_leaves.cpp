#include "growth/best_first/open_leaves.hpp"

#include <limits>
#include <numeric>

namespace llmt {
namespace {

// From this many rows on inputs are cut into bins. Nodes with fewer rows than the other number are searched exactly
// even then, and by RA have features of their own. The program `study modes` prints where these pay.
constexpr Eigen::Index binned_rows = 200000;
constexpr Eigen::Index exact_rows = 2000;

bool is_searched_by_bins(const GrowthData& data) {
  if (data.problem.criterion == SplitCriterion::residual_signs) return false;
  switch (data.problem.options.search) {
    case SplitSearch::exact:
      return false;
    case SplitSearch::binned:
      return BinnedLeaves::possible(data);
    case SplitSearch::automatic:
      break;
  }
  return data.training.count() >= binned_rows && BinnedLeaves::possible(data);
}

bool is_searched_by_residuals(const GrowthData& data) {
  return data.problem.criterion == SplitCriterion::residual_signs && data.training.count() >= exact_rows &&
         is_complete(data);
}

}  // namespace

OpenLeaves::OpenLeaves(const GrowthData& data) : data_(data), exact_(data) {
  if (is_searched_by_bins(data)) {
    binned_.emplace(data);
  } else if (is_searched_by_residuals(data)) {
    residual_.emplace(data);
  }
}

OpenLeaf OpenLeaves::root(const Node& parentless) const {
  OpenLeaf root;
  if (binned_) {
    root.data = binned_->root();
  } else if (residual_) {
    root.data = residual_->root();
  } else {
    std::vector<int> rows(data_.training.count());
    std::iota(rows.begin(), rows.end(), 0);
    root.data = exact_.open(rows, parentless);
  }
  return root;
}

void OpenLeaves::examine(OpenLeaf& leaf, const Node& parent, Node& node) {
  if (BinnedLeaf* const binned = std::get_if<BinnedLeaf>(&leaf.data)) {
    leaf.best = binned_->examine(*binned, parent, node, leaf.excess);
    leaf.weight = binned->weight;
  } else if (ResidualLeaf* const residual = std::get_if<ResidualLeaf>(&leaf.data)) {
    leaf.best = residual_->examine(*residual, parent, node);
    leaf.weight = residual->weight;
  } else {
    ExactLeaf& exact = std::get<ExactLeaf>(leaf.data);
    leaf.best = exact_.examine(exact, parent, node);
    leaf.weight = exact.weights.sum();
  }
  leaf.rss = data_.output_weights.dot(node.rss);
}

void OpenLeaves::wait(OpenLeaf& leaf) {
  if (BinnedLeaf* const binned = std::get_if<BinnedLeaf>(&leaf.data)) binned_->wait(*binned);
}

OpenLeaves::Children OpenLeaves::divide(OpenLeaf& leaf, const Node& node) {
  if (BinnedLeaf* const binned = std::get_if<BinnedLeaf>(&leaf.data)) {
    return open_parts(*binned, binned_->divide(*binned, leaf.best), node);
  }
  if (ResidualLeaf* const residual = std::get_if<ResidualLeaf>(&leaf.data)) {
    return open_parts(*residual, residual_->divide(*residual, leaf.best), node);
  }
  ExactLeaves::Children parts = exact_.divide(std::get<ExactLeaf>(leaf.data), node, leaf.best);
  Children children;
  children.missing_left = parts.missing_left;
  for (std::size_t side = 0; side < 2; ++side) {
    children.leaves[side].data = std::move(parts.leaves[side]);
  }
  return children;
}

// Small parts go on as exact leaves. No value is missing here, so the left child's share for rows without a value is
// its share of the rows.
template <class Leaf>
OpenLeaves::Children OpenLeaves::open_parts(const Leaf& leaf, std::array<Leaf, 2> parts, const Node& parent) const {
  Children children;
  children.missing_left = static_cast<double>(parts[0].rows.size()) / static_cast<double>(leaf.rows.size());
  for (std::size_t side = 0; side < 2; ++side) {
    if (std::ssize(parts[side].rows) < exact_rows) {
      children.leaves[side].data = exact_.open(parts[side].rows, parent);
    } else {
      children.leaves[side].data = std::move(parts[side]);
    }
  }
  return children;
}

double OpenLeaves::threshold(const OpenLeaf& leaf, const Node& node, const Node& left, const Node& right) const {
  if (leaf.best.by_missing) return std::numeric_limits<double>::max();
  if (!leaf.best.level_side.empty()) return 0.0;
  if (const BinnedLeaf* const binned = std::get_if<BinnedLeaf>(&leaf.data)) {
    return binned_->threshold(*binned, leaf.best, node, left, right);
  }
  if (const ResidualLeaf* const residual = std::get_if<ResidualLeaf>(&leaf.data)) {
    return residual_->threshold(*residual, leaf.best, node, left, right);
  }
  return exact_.threshold(std::get<ExactLeaf>(leaf.data), leaf.best, node, left, right);
}

}  // namespace llmt
