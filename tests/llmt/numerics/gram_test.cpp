#include "numerics/gram.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

using Eigen::Index;
using llmt::Features;
using llmt::GramShape;

namespace {

Features random_features(Index rows, Index columns) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Features features(rows, columns - 1, 1);
  for (Index i = 0; i < rows; ++i) {
    for (Index j = 0; j < columns; ++j) features.row(i)[j] = uniform(random);
  }
  return features;
}

}  // namespace

// Rows of up to 2304 columns are copied into a buffer, longer ones are not.
TEST(Gram, SumsOfRowsOfAnyLengthEqualBruteForce) {
  for (const Index columns : {2, 3, 8, 16, 17, 33, 255, 1160, 2303, 2304, 2305, 2500}) {
    const Features features = random_features(150, columns);
    std::vector<int> rows;
    for (int row = 149; row >= 0; row -= 2) rows.push_back(row);
    const GramShape shape(features);
    // The sums are written in whole vectors: beside them nothing may be touched.
    constexpr double untouched = 1e300;
    std::vector<double> gram(shape.size() + 2 * GramShape::lanes, 0.0);
    std::fill(gram.end() - 2 * GramShape::lanes, gram.end(), untouched);
    llmt::add_rows(features, rows.data(), std::ssize(rows), gram.data());
    for (Index i = 0; i < columns; i += std::max<Index>(1, columns / 50)) {
      for (Index j = 0; j <= i; j += j + 3 < i ? std::max<Index>(1, columns / 50) : 1) {
        long double sum = 0.0L;
        for (const int row : rows) {
          sum += static_cast<long double>(features.row(row)[i]) * features.row(row)[j];
        }
        ASSERT_NEAR(gram[shape.at(i, j)], static_cast<double>(sum), 1e-13) << columns << ": " << i << ", " << j;
      }
    }
    for (Index k = shape.size(); k < std::ssize(gram); ++k) ASSERT_EQ(gram[k], untouched) << columns;
  }
}
