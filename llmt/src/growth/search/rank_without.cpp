#include "growth/search/rank_without.hpp"

#include <vector>

namespace llmt {

// The subtraction leaves rounding of 1e-15 of a column's sum of squares, which is less than a pivot that counts.
int rank_without(const Features& features, const double* gram, std::span<const int> rows, ResidualSums& sums) {
  const GramShape shape(features);
  std::vector<double> rest(gram, gram + shape.size());
  for (const int row : rows) {
    const double* const at = features.row(row);
    for (Eigen::Index i = 0; i < shape.columns(); ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) rest[shape.at(i, j)] -= at[i] * at[j];
    }
  }
  const double* const first = rest.data();
  double rss = 0.0;
  int rank = 0;
  sums.evaluate(&first, 1, &rss, &rank);
  return rank;
}

}  // namespace llmt
