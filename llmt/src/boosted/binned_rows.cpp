#include "boosted/binned_rows.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/between.hpp"

namespace llmt {
namespace {

struct RowOfValue {
  double value = 0.0;
  int row = 0;
};

// The rows that have a value, by their values; equal ones as they come.
std::vector<RowOfValue> by_values(const Eigen::VectorXd& values) {
  std::vector<RowOfValue> rows;
  rows.reserve(values.size());
  for (int i = 0; i < values.size(); ++i) {
    if (!std::isnan(values(i))) rows.push_back({values(i), i});
  }
  std::ranges::sort(rows, [](const RowOfValue& a, const RowOfValue& b) {
    return a.value < b.value || (a.value == b.value && a.row < b.row);
  });
  return rows;
}

struct Distinct {
  double value = 0.0;
  double weight = 0.0;
};

std::vector<Distinct> distinct_values(const std::vector<RowOfValue>& rows, const Eigen::VectorXd& weights) {
  std::vector<Distinct> result;
  for (const auto [value, row] : rows) {
    if (weights(row) <= 0.0) continue;
    if (result.empty() || result.back().value < value) result.push_back({value, 0.0});
    result.back().weight += weights(row);
  }
  return result;
}

// Cuts weights in a row into at most `most` parts of about equal weight, and returns the last index of each part. What
// is heavier than a part is one of its own; the others share the parts that are left.
std::vector<int> cut(const std::vector<double>& weights, int most) {
  std::vector<int> last;
  const int count = static_cast<int>(weights.size());
  double left = std::accumulate(weights.begin(), weights.end(), 0.0);
  int parts_left = most;
  double in_part = 0.0;
  for (int k = 0; k + 1 < count; ++k) {
    in_part += weights[k];
    if (count > most && in_part + weights[k + 1] / 2.0 < left / parts_left) continue;
    if (std::ssize(last) + 1 == most) break;
    last.push_back(k);
    left -= in_part;
    in_part = 0.0;
    --parts_left;
  }
  if (count > 0) last.push_back(count - 1);
  return last;
}

}  // namespace

BinnedFeature bin_feature(BoostedFeature feature, const Eigen::VectorXd& values, const Eigen::VectorXd& weights) {
  BinnedFeature result;
  result.feature = feature;
  const std::vector<RowOfValue> rows = by_values(values);
  const std::vector<Distinct> distinct = distinct_values(rows, weights);
  if (!distinct.empty()) {
    result.low = distinct.front().value;
    result.high = distinct.back().value;
  }
  std::vector<double> weights_of_values;
  for (const Distinct& one : distinct) weights_of_values.push_back(one.weight);
  std::vector<double> weights_of_cells;
  std::vector<double> sums_of_cells;
  int value = 0;
  for (const int last : cut(weights_of_values, most_cells)) {
    weights_of_cells.push_back(0.0);
    sums_of_cells.push_back(0.0);
    for (; value <= last; ++value) {
      weights_of_cells.back() += distinct[value].weight;
      sums_of_cells.back() += distinct[value].weight * distinct[value].value;
    }
    if (value < std::ssize(distinct)) result.edges.push_back(between(distinct[last].value, distinct[value].value));
  }
  result.last_cells = cut(weights_of_cells, most_bins);
  std::vector<std::uint8_t> bin_of_cell;
  for (const int last : result.last_cells) {
    double weight = 0.0;
    double sum = 0.0;
    while (std::ssize(bin_of_cell) <= last) {
      weight += weights_of_cells[bin_of_cell.size()];
      sum += sums_of_cells[bin_of_cell.size()];
      bin_of_cell.push_back(static_cast<std::uint8_t>(result.centres.size()));
    }
    result.centres.push_back(weight > 0.0 ? sum / weight : 0.0);
  }
  result.has_missing = std::ssize(rows) < values.size();
  result.cells.assign(values.size(), missing_cell);
  std::size_t cell = 0;
  for (const RowOfValue& one : rows) {
    while (cell < result.edges.size() && result.edges[cell] < one.value) ++cell;
    result.cells[one.row] = static_cast<std::uint16_t>(cell);
  }
  result.bins.resize(values.size());
  result.values.resize(values.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const bool is_missing = result.cells[i] == missing_cell;
    result.bins[i] = is_missing ? missing_bin : bin_of_cell[result.cells[i]];
    result.values[i] = is_missing ? 0.0F : static_cast<float>(values(i));
  }
  return result;
}

std::vector<int> all_rows(Eigen::Index count) {
  std::vector<int> all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

}  // namespace llmt
