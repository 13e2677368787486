#include "data/rounding.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/count.hpp"
#include "base/parallel.hpp"

namespace llmt {
namespace {

// Values are equal if they differ by no more than this part of the spread of their column, ...
constexpr double part_of_spread = 1e-6;

// ... and by no more than this part of the distance that as many values have, spread evenly: values that lie close only
// because they are many are different.
constexpr double part_of_distance = 0.01;

// A column is left as it is unless at least this part of its different values vanish. By chance 1 % do at most.
constexpr double fewest_equal = 0.1;

using Entry = std::pair<double, Eigen::Index>;  // value and row

// `different`: values, ascending.
double rounding_of(const std::vector<double>& different) {
  const auto last = static_cast<double>(different.size() - 1);
  const auto half = [&](double part) { return 0.5 * different[static_cast<std::size_t>(part * last)]; };
  // Halves, because the difference of two numbers may be none.
  double half_spread = half(0.9) - half(0.1);
  if (half_spread == 0.0) half_spread = half(1.0) - half(0.0);
  return half_spread * (2.0 * std::min(part_of_spread, part_of_distance / static_cast<double>(different.size())));
}

// Of each sorted value what it becomes; empty: it stays as it is.
std::vector<double> settled(const std::vector<Entry>& sorted) {
  std::vector<double> different;
  for (const Entry& each : sorted) {
    if (different.empty() || each.first > different.back()) different.push_back(each.first);
  }
  const double distance = rounding_of(different);
  if (!std::isfinite(distance)) return {};  // a column that has not been checked yet
  std::size_t vanish = 0;
  for (std::size_t i = 1; i < different.size(); ++i) vanish += different[i] - different[i - 1] <= distance ? 1 : 0;
  if (static_cast<double>(vanish) <= fewest_equal * static_cast<double>(different.size())) return {};
  std::vector<double> values;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    if (i > 0 && sorted[i].first - sorted[i - 1].first > distance) begin = i;
    values.push_back(sorted[begin].first);
  }
  std::fill(values.begin() + static_cast<std::ptrdiff_t>(begin), values.end(), sorted.back().first);
  return values;
}

}  // namespace

std::optional<Eigen::MatrixXd> without_rounding(const Eigen::Ref<const Eigen::MatrixXd>& table,
                                                const std::vector<Eigen::Index>& rows, int max_threads) {
  std::vector<std::vector<Entry>> changed(table.cols());
  parallel_for(table.cols(), max_threads, [&](Eigen::Index j) {
    std::vector<Entry> sorted;
    for (const Eigen::Index row : rows) {
      if (!std::isnan(table(row, j))) sorted.emplace_back(table(row, j), row);
    }
    if (sorted.empty()) return;
    std::ranges::sort(sorted);
    const std::vector<double> values = settled(sorted);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i] != sorted[i].first) changed[j].emplace_back(values[i], sorted[i].second);
    }
  });
  if (std::ranges::all_of(changed, [](const std::vector<Entry>& column) { return column.empty(); }))
    return std::nullopt;
  Eigen::MatrixXd result = table;
  for (int j = 0; j < count_of(changed); ++j) {
    for (const auto& [value, row] : changed[j]) result(row, j) = value;
  }
  return result;
}

}  // namespace llmt
