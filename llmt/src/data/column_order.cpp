#include "data/column_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "data/row_hash.hpp"

namespace llmt {
namespace {

// -1, 0 or 1, and 2 or 3 where one of the values is missing.
double direction(double from, double to) {
  if (std::isnan(from) || std::isnan(to)) return std::isnan(to) ? 2.0 : 3.0;
  return static_cast<double>(to > from) - static_cast<double>(to < from);
}

std::uint64_t hash_of(const Eigen::Ref<const Eigen::VectorXd>& column) {
  const Eigen::Index rows = column.size();
  std::uint64_t hash = 0;
  for (Eigen::Index i = 0; i < rows; ++i) {  // the next row, and one far away, for tables in which neighbours are alike
    hash = row_hash(hash, direction(column(i), column((i + 1) % rows)));
    hash = row_hash(hash, direction(column(i), column((i + rows / 2) % rows)));
  }
  return hash;
}

}  // namespace

std::vector<int> column_order(const Eigen::Ref<const Eigen::MatrixXd>& table) {
  std::vector<std::uint64_t> hashes;
  for (Eigen::Index j = 0; j < table.cols(); ++j) hashes.push_back(hash_of(table.col(j)));
  std::vector<int> order(hashes.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](int column) { return hashes[column]; });
  return order;
}

}  // namespace llmt
