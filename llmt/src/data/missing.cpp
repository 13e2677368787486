#include "data/missing.hpp"

#include <cmath>

namespace llmt {

RowMajor all_deviations(const TrainingRows& rows) {
  RowMajor all(rows.count(), std::ssize(rows.regressors));
  for (Eigen::Index block = 0; block < num_chunks(rows); ++block) {
    const Chunk chunk = fetch(rows, block, {});
    all.middleRows(block * block_rows, chunk.count()) = chunk.deviations;
  }
  return all;
}

double mean_of_present(const RowMajor& x, Eigen::Index column, const Eigen::VectorXd& weights) {
  const auto add = [&](RowSpan block, WeightedMean& mean) {
    for (Eigen::Index i = block.begin; i < block.end; ++i) {
      if (!std::isnan(x(i, column))) mean.add(x(i, column), weights(i));
    }
  };
  return sum_over(RowBlocks{x.rows()}, 1, WeightedMean{}, add).value();
}

}  // namespace llmt
