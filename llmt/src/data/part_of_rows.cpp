// Fewer inputs or fewer rows of some training rows.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/parallel.hpp"
#include "data/dataset.hpp"
#include "data/regressors.hpp"
#include "model/through_regressors.hpp"

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

TrainingRows thinned(const TrainingRows& rows, Eigen::Index count, int max_threads) {
  TrainingRows result = rows;
  if (rows.count() <= count + count / 4) return result;
  // The rows with the smallest hashes of their values. Steps of splitmix64 (Steele, Lea & Flood 2014).
  const auto mixed = [](std::uint64_t state, double value) {
    std::uint64_t z = state + std::bit_cast<std::uint64_t>(value + 0.0) + 0x9e3779b97f4a7c15ULL;  // -0 as 0
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  };
  std::vector<std::uint64_t> hashes(rows.rows.size(), 0);
  parallel_for(num_chunks(rows), max_threads, [&](Eigen::Index index) {
    const Eigen::Index end = std::min(rows.count(), (index + 1) * chunk_rows);
    for (Eigen::Index i = index * chunk_rows; i < end; ++i) {
      const int row = rows.rows[i];
      for (Eigen::Index j = 0; j < rows.table->inputs.cols(); ++j) {
        const double value = rows.table->inputs(row, j);
        hashes[i] = mixed(hashes[i], std::isnan(value) ? std::numeric_limits<double>::infinity() : value);
      }
      for (Eigen::Index o = 0; o < rows.table->outputs.cols(); ++o) {
        hashes[i] = mixed(hashes[i], rows.table->outputs(row, o));
      }
    }
  });
  std::vector<std::uint64_t> order = hashes;
  std::nth_element(order.begin(), order.begin() + (count - 1), order.end());
  const std::uint64_t last = order[count - 1];
  result.rows.clear();
  for (std::size_t i = 0; i < hashes.size(); ++i) {
    if (hashes[i] <= last) {
      result.rows.push_back(rows.rows[i]);
    }
  }
  result.weight_unit *= total_weight(rows) / total_weight(result);
  return result;
}

}  // namespace llmt
