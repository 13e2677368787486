#include "numerics/gram.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
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

// Five parts of ten rows have four cuts; ten more rows each lie left and right of all cuts.
TEST(SidesOfCuts, SumsAndModelsAreThoseOfTheRowsOnEitherSide) {
  constexpr Index part_rows = 10;
  const Features features = random_features(7 * part_rows, 4);
  const GramShape shape(features);
  std::vector<int> rows(features.rows());
  std::iota(rows.begin(), rows.end(), 0);
  const auto gram_of = [&](Index begin, Index end) {
    std::vector<double> gram(shape.size(), 0.0);
    llmt::add_rows(features, rows.data() + begin * part_rows, (end - begin) * part_rows, gram.data());
    return gram;
  };
  llmt::ResidualSums models(shape, Eigen::VectorXd::Ones(1));
  for (const bool has_ends : {false, true}) {
    std::vector<std::vector<double>> grams;
    std::vector<const double*> parts;
    for (Index part = 1; part <= 5; ++part) grams.push_back(gram_of(part, part + 1));
    for (const std::vector<double>& gram : grams) parts.push_back(gram.data());
    const std::vector<double> before = gram_of(0, 1);
    const std::vector<double> behind = gram_of(6, 7);
    llmt::SidesOfCuts sides;
    has_ends ? sides.sum(shape, parts, before.data(), behind.data()) : sides.sum(shape, parts);
    sides.evaluate(models);
    ASSERT_EQ(sides.rss_left.size(), 4U);
    for (Index cut = 0; cut < 4; ++cut) {
      for (const bool left : {true, false}) {
        const std::vector<double> expected =
            left ? gram_of(has_ends ? 0 : 1, cut + 2) : gram_of(cut + 2, has_ends ? 7 : 6);
        const double* const found = (left ? sides.left : sides.right).data() + cut * shape.size();
        for (Index i = 0; i < 4; ++i) {
          for (Index j = 0; j <= i; ++j) EXPECT_NEAR(found[shape.at(i, j)], expected[shape.at(i, j)], 1e-12);
        }
        const double* const gram = expected.data();
        double rss = 0.0;
        int rank = 0;
        models.evaluate(&gram, 1, &rss, &rank);
        EXPECT_NEAR((left ? sides.rss_left : sides.rss_right)[cut], rss, 1e-12);
        EXPECT_EQ((left ? sides.rank_left : sides.rank_right)[cut], rank);
      }
    }
  }
  llmt::SidesOfCuts none;
  none.sum(shape, {});
  none.evaluate(models);
  EXPECT_TRUE(none.rss_left.empty());
}
