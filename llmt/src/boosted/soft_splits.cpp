// Splits at which rows go to both sides.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/simd.hpp"
#include "boosted/growing_tree.hpp"
#include "boosted/model/transition.hpp"

namespace llmt {
namespace {

// So many rows at a time, in arrays that stay in the cache.
constexpr std::size_t most_rows = 256;
using Numbers = std::array<double, most_rows>;

// Of each row its value of the split's feature (NaN: missing), and 1 if it lies on the right side, else 0.
void look_up(std::span<const int> rows, const GrowingNode& node, const BinnedFeature& column, Numbers& z,
             Numbers& is_right) {
  const std::uint16_t* const cells = column.cells.data();
  const float* const values = column.values.data();
  const int last_left = node.cell;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    z[k] = values[rows[k]];
    is_right[k] = cells[rows[k]] > last_left ? 1.0 : 0.0;
  }
  if (!column.has_missing) return;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (cells[rows[k]] != missing_cell) continue;
    z[k] = std::numeric_limits<double>::quiet_NaN();
    is_right[k] = 1.0 - node.missing_left;
  }
}

// The same of rows that the split has just put in order, `in_left` of them on the left side. None lacks a value.
void look_up(std::span<const float> values, std::ptrdiff_t in_left, Numbers& z, Numbers& is_right) {
  std::ranges::copy(values, z.begin());
  const auto first_right = is_right.begin() + std::clamp<std::ptrdiff_t>(in_left, 0, std::ssize(values));
  std::fill(is_right.begin(), first_right, 0.0);
  std::fill(first_right, is_right.begin() + std::ssize(values), 1.0);
}

// Splits the shares of rows. Choices in place of branches, which no processor could foresee.
LLMT_FOR_EACH_INSTRUCTION_SET
void split_shares(std::size_t count, double threshold, double half_width, const double* z, const double* is_right,
                  const double* shares, double* __restrict left, double* __restrict right) {
  for (std::size_t k = 0; k < count; ++k) {
    const double soft = share_of_right(z[k], threshold, half_width);
    const double smaller = shares[k] * (soft < 1.0 - soft ? soft : 1.0 - soft);
    double to_right = smaller >= smallest_share ? soft : is_right[k];
    to_right = std::abs(z[k] - threshold) < half_width ? to_right : is_right[k];
    left[k] = shares[k] * (1.0 - to_right);
    right[k] = shares[k] * to_right;
  }
}

// Squares of the residuals of rows in a transition, as they are and if the models of both sides are blended.
struct Squares {
  double crisp = 0.0;
  double blended = 0.0;
};

// `constant` and `slope`: by which the right side's model differs from the left one's.
LLMT_FOR_EACH_INSTRUCTION_SET
Squares squares_of(std::size_t count, double threshold, double half_width, double constant, double slope,
                   const double* z, const double* is_right, const double* residuals, const double* weights) {
  Numbers crisp;
  Numbers blended;
  for (std::size_t k = 0; k < count; ++k) {
    const double weight = std::abs(z[k] - threshold) < half_width ? weights[k] : 0.0;
    const double moved = share_of_right(z[k], threshold, half_width) - is_right[k];
    const double residual = weight > 0.0 ? residuals[k] - moved * (constant + slope * z[k]) : 0.0;
    crisp[k] = weight * residuals[k] * residuals[k];
    blended[k] = weight * residual * residual;
  }
  Squares sums;
  for (std::size_t k = 0; k < count; ++k) {
    sums.crisp += crisp[k];
    sums.blended += blended[k];
  }
  return sums;
}

double slope_in(const PathModel& model, int feature) {
  const auto found = std::ranges::find(model.features, feature);
  return found == model.features.end() ? 0.0 : model.slopes[found - model.features.begin()];
}

}  // namespace

double TreeGrower::half_width_of(int index) const {
  const GrowingNode& node = tree_[index];
  const BinnedFeature& column = rows_.features[node.feature];
  const double threshold = column.edges[node.cell];
  double low = column.low;
  double high = column.high;
  for (int below = index, above = node.parent; above >= 0; below = above, above = tree_[above].parent) {
    if (tree_[above].feature != node.feature) continue;
    const double border = column.edges[tree_[above].cell];
    if (tree_[above].left == below) {
      high = std::min(high, border);
    } else {
      low = std::max(low, border);
    }
  }
  return std::max(0.0, options_.softness * std::min(threshold - low, high - threshold));
}

// Whether the rows in the transition are predicted about as well by both children's models blended. The models differ
// in what the split added to them, a constant and a slope in its feature.
bool TreeGrower::blends_well(int index, double half_width) const {
  constexpr double allowed = 1.1;
  const GrowingNode& node = tree_[index];
  const BinnedFeature& column = rows_.features[node.feature];
  const PathModel& left = tree_[node.left].model;
  const PathModel& right = tree_[node.right].model;
  const double constant = right.constant - left.constant;
  const double slope = slope_in(right, node.feature) - slope_in(left, node.feature);
  Numbers z;
  Numbers is_right;
  Squares sums;
  for (Eigen::Index k = node.begin; k < node.end; k += most_rows) {
    const std::size_t count = std::min<std::size_t>(most_rows, node.end - k);
    if (column.has_missing) {
      look_up(std::span(order_).subspan(k, count), node, column, z, is_right);
    } else {
      look_up(std::span(values_).subspan(k, count), tree_[node.right].begin - k, z, is_right);
    }
    const Squares some = squares_of(count, column.edges[node.cell], half_width, constant, slope, z.data(),
                                    is_right.data(), &residuals_[k], &weights_[k]);
    sums.crisp += some.crisp;
    sums.blended += some.blended;
  }
  return sums.blended <= allowed * sums.crisp;
}

// The same shares as visit(), node by node.
void TreeGrower::share_rows() {
  if (soft_rows_.size() < tree_.size()) soft_rows_.resize(tree_.size());
  SoftRows& all = soft_rows_[0];
  all.count = static_cast<std::size_t>(count_);
  all.make_room(all.count);
  std::iota(all.rows.begin(), all.rows.begin() + count_, 0);
  std::fill_n(all.shares.begin(), count_, 1.0);
  for (std::size_t index = 0; index < tree_.size(); ++index) {
    if (tree_[index].feature >= 0) share_rows_of(static_cast<int>(index));
  }
}

void TreeGrower::share_rows_of(int index) {
  const GrowingNode& node = tree_[index];
  const BinnedFeature& column = rows_.features[node.feature];
  const SoftRows& here = soft_rows_[index];
  SoftRows& left = soft_rows_[node.left];
  SoftRows& right = soft_rows_[node.right];
  left.make_room(here.count);
  right.make_room(here.count);
  std::size_t in_left = 0;
  std::size_t in_right = 0;
  Numbers z;
  Numbers is_right;
  Numbers to_left;
  Numbers to_right;
  for (std::size_t begin = 0; begin < here.count; begin += most_rows) {
    const std::size_t count = std::min(most_rows, here.count - begin);
    const std::span rows = std::span(here.rows).subspan(begin, count);
    look_up(rows, node, column, z, is_right);
    split_shares(count, column.edges[node.cell], node.half_width, z.data(), is_right.data(), &here.shares[begin],
                 to_left.data(), to_right.data());
    // A row is written to both sides, and counts where it has a share.
    for (std::size_t k = 0; k < count; ++k) {
      left.rows[in_left] = right.rows[in_right] = rows[k];
      left.shares[in_left] = to_left[k];
      right.shares[in_right] = to_right[k];
      in_left += static_cast<std::size_t>(to_left[k] > 0.0);
      in_right += static_cast<std::size_t>(to_right[k] > 0.0);
    }
  }
  left.count = in_left;
  right.count = in_right;
}

}  // namespace llmt
