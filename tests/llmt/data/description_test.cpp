// Samples of rows, and the columns and regressors that rows describe.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "data/dataset.hpp"
#include "data/row_hash.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"

namespace {

std::vector<int> all(Eigen::Index count) {
  std::vector<int> rows(count);
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

TEST(RowHash, IsTheSameForZerosOfEitherSignAndForAllNaN) {
  EXPECT_EQ(llmt::row_hash(7, 0.0), llmt::row_hash(7, -0.0));
  EXPECT_EQ(llmt::row_hash(7, std::nan("1")), llmt::row_hash(7, -std::nan("2")));
  EXPECT_NE(llmt::row_hash(7, 0.0), llmt::row_hash(7, std::nan("")));
  EXPECT_NE(llmt::row_hash(llmt::row_hash(0, 1.0), 2.0), llmt::row_hash(llmt::row_hash(0, 2.0), 1.0));
}

// More than two large blocks, and rows that are there four times.
TEST(SmallestHashes, AreThoseOfAFullSort) {
  const Eigen::Index count = 140000;
  Eigen::MatrixXd x = oracle::uniform(count, 2, 1);
  for (Eigen::Index i = 0; i < count; ++i) x.row(i) = x.row(i / 4);
  const Eigen::MatrixXd y = x.col(0) - x.col(1);
  const llmt::Table table{x, y, Eigen::VectorXd::Ones(count), {0, 0}, {0, 1}, {0, 1}};
  llmt::TrainingRows rows;
  rows.table = &table;
  rows.rows = all(count);
  std::vector<std::uint64_t> hashes;
  for (Eigen::Index i = 0; i < count; ++i) {
    hashes.push_back(llmt::row_hash(llmt::row_hash(llmt::row_hash(0, x(i, 0)), x(i, 1)), y(i, 0)));
  }
  std::vector<std::uint64_t> sorted = hashes;
  std::ranges::sort(sorted);
  for (const Eigen::Index smallest : {1, 1000, 3001, 100000, 140000, 150000}) {
    std::vector<int> expected;
    for (int i = 0; i < count; ++i) {
      if (hashes[i] <= sorted[std::min(smallest, count) - 1]) expected.push_back(i);
    }
    EXPECT_EQ(llmt::smallest_hashes(rows, smallest, 1), expected) << smallest;
    EXPECT_EQ(llmt::smallest_hashes(rows, smallest, 3), expected) << smallest;
  }
}

// Against sums of long doubles, over some rows in several blocks.
TEST(Description, OfColumnsAndRegressorsIsThatOfTheRows) {
  const Eigen::Index count = 9000;
  Eigen::MatrixXd x = oracle::uniform(count, 3, 2);
  x.col(1) = (1e3 + x.col(1).array()).matrix();
  x.col(2) = (1.6 * (x.col(2).array() + 1.0)).floor().matrix();  // levels 0 to 3, the last the rarest
  for (Eigen::Index i = 0; i < count; i += 50) x(i, i % 3) = oracle::missing;
  const Eigen::MatrixXd y = oracle::uniform(count, 1, 3);
  const Eigen::VectorXd weights = oracle::uniform(count, 1, 4).array() + 1.5;
  llmt::Table table{x, y, weights, {0, 0, 4}, {0, 1, 2}, {0, 1, 2}};
  table.products = {{0, 1}};
  std::vector<int> rows;
  for (int i = 0; i < count; ++i) {
    if (i % 7 > 0) rows.push_back(i);
  }
  const llmt::TrainingRows training = llmt::training_rows(table, rows);
  ASSERT_EQ(training.regressors.size(), 6U);  // two numbers, three levels, a product
  long double total = 0.0;
  for (const int row : rows) total += weights(row);
  EXPECT_TRUE(training.has_missing);
  EXPECT_NEAR(training.weight_unit, static_cast<double>(rows.size() / total), 1e-14);
  for (std::size_t k = 0; k < training.regressors.size(); ++k) {
    const llmt::Regressor& regressor = training.regressors[k];
    const auto value_at = [&](int row) {
      const double value = x(row, regressor.input);
      if (regressor.level >= 0) return std::isnan(value) ? value : value == regressor.level ? 1.0 : 0.0;
      if (k < 5) return value;
      return (value - training.columns[0].centre) * (x(row, 1) - training.columns[1].centre);
    };
    long double product = 0.0;
    long double present = 0.0;
    std::vector<double> values;
    for (const int row : rows) {
      const double value = value_at(row);
      if (std::isnan(value)) continue;
      product += static_cast<long double>(weights(row)) * value;
      present += weights(row);
      values.push_back(value);
    }
    const double mean = static_cast<double>(product / present);
    EXPECT_NEAR(regressor.centre, mean, 1e-13 * (1.0 + std::abs(mean))) << k;
    long double squares = 0.0;
    for (const int row : rows) {
      const double value = value_at(row);
      if (!std::isnan(value)) squares += weights(row) * (value - mean) * (value - mean);
    }
    EXPECT_NEAR(training.scale(k), static_cast<double>(std::sqrt(squares / total)), 1e-12 * training.scale(k)) << k;
    std::ranges::sort(values);
    const std::size_t skipped = regressor.level < 0 ? 1 : 0;
    EXPECT_NEAR(training.spread(0, k), values[skipped] - mean, 1e-12) << k;
    EXPECT_NEAR(training.spread(1, k), values[values.size() - 1 - skipped] - mean, 1e-12) << k;
  }
  double low = 2.0;
  double high = -2.0;
  for (const int row : rows) {
    low = std::min(low, y(row, 0));
    high = std::max(high, y(row, 0));
  }
  EXPECT_EQ(training.output_columns[0].low, low);
  EXPECT_EQ(training.output_columns[0].high, high);
}

}  // namespace
