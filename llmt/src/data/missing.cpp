#include "data/missing.hpp"

#include <cmath>

namespace llmt {

RowMajor all_deviations(const TrainingRows& rows) {
  RowMajor all(rows.count(), std::ssize(rows.regressors));
  for (Eigen::Index index = 0; index < num_chunks(rows); ++index) {
    const Chunk chunk = fetch(rows, index, {});
    all.middleRows(index * chunk_rows, chunk.count()) = chunk.deviations;
  }
  return all;
}

double mean_of_present(const RowMajor& x, Eigen::Index column, const Eigen::VectorXd& weights) {
  double sum = 0.0;
  double present = 0.0;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (!std::isnan(x(i, column))) {
      sum += weights(i) * x(i, column);
      present += weights(i);
    }
  }
  return present > 0.0 ? sum / present : 0.0;
}

}  // namespace llmt
