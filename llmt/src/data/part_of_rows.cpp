// Fewer inputs or fewer rows of some training rows.
#include <algorithm>
#include <compare>
#include <cstdint>
#include <tuple>

#include "data/dataset.hpp"
#include "data/row_hash.hpp"
#include "partition/through_regressors.hpp"

namespace llmt {

TrainingRows narrowed(const TrainingRows& rows, const std::vector<int>& inputs) {
  const auto is_kept = [&](int input) { return std::ranges::binary_search(inputs, input); };
  TrainingRows result = rows;
  std::erase_if(result.split_inputs, [&](int input) { return !is_kept(input); });
  std::vector<Eigen::Index> kept;
  result.regressors.clear();
  for (Eigen::Index k = 0; k < std::ssize(rows.regressors); ++k) {
    const Regressor& regressor = rows.regressors[k];
    if (is_kept(regressor.input) && (!is_product(regressor) || is_kept(regressor.second_input))) {
      kept.push_back(k);
      result.regressors.push_back(regressor);
    }
  }
  if (rows.scale.size() > 0) {  // rows that are held out are not described
    result.scale = rows.scale(kept);
    result.spread = rows.spread(Eigen::all, kept);
  }
  const auto lacks = [&](int input) { return rows.table->inputs(rows.rows, input).hasNaN(); };
  result.has_missing = rows.has_missing && std::ranges::any_of(result.regressors, [&](const Regressor& regressor) {
                         return lacks(regressor.input) || (is_product(regressor) && lacks(regressor.second_input));
                       });
  return result;
}

namespace {

// The rows with the smallest hashes among some rows. Adding two of these is no sum of numbers, but it may be done in
// any order as well.
struct SmallestHashes {
  struct Row {
    std::uint64_t hash;
    Eigen::Index position;
    auto operator<=>(const Row&) const = default;
  };
  Eigen::Index count = 0;
  std::vector<Row> rows;

  // Leaves out rows until there are `count`, or more whose hashes are equal.
  void trim() {
    if (std::ssize(rows) <= count) return;
    const auto last = rows.begin() + (count - 1);
    std::nth_element(rows.begin(), last, rows.end());
    const auto beyond = [largest = last->hash](const Row& row) { return row.hash > largest; };
    rows.erase(std::remove_if(last, rows.end(), beyond), rows.end());
  }

  SmallestHashes& operator+=(SmallestHashes other) {
    rows.insert(rows.end(), other.rows.begin(), other.rows.end());
    trim();
    return *this;
  }
  static auto fields(auto& self) { return std::tie(self.count, self.rows); }
};

}  // namespace

std::vector<int> smallest_hashes(const TrainingRows& rows, Eigen::Index count, int max_threads) {
  const Table& table = *rows.table;
  const auto add = [&](RowSpan block, SmallestHashes& sum) {
    std::vector<std::uint64_t> hashes(block.count(), 0);
    for (const auto* columns : {&table.inputs, &table.outputs}) {
      for (Eigen::Index j = 0; j < columns->cols(); ++j) {
        for (Eigen::Index k = 0; k < block.count(); ++k) {
          hashes[k] = row_hash(hashes[k], (*columns)(rows.rows[block.begin + k], j));
        }
      }
    }
    for (Eigen::Index k = 0; k < block.count(); ++k) sum.rows.push_back({hashes[k], block.begin + k});
    sum.trim();
  };
  const SmallestHashes smallest =
      sum_over(RowBlocks{rows.count(), large_block_rows}, max_threads, SmallestHashes{count, {}}, add);
  std::vector<int> positions;
  for (const auto& row : smallest.rows) positions.push_back(static_cast<int>(row.position));
  std::ranges::sort(positions);
  return positions;
}

TrainingRows subsample(const TrainingRows& rows, Eigen::Index count, int max_threads) {
  TrainingRows result = rows;
  if (rows.count() <= count + count / 4) return result;
  result.rows.clear();
  for (const int position : smallest_hashes(rows, count, max_threads)) result.rows.push_back(rows.rows[position]);
  result.weight_unit *= total_weight(rows) / total_weight(result);
  return result;
}

}  // namespace llmt
