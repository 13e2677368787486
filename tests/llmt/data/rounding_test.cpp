// Values that are equal but for rounding.
#include "data/rounding.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "oracles/oracles.hpp"

namespace {

std::vector<Eigen::Index> every_row(Eigen::Index count) {
  std::vector<Eigen::Index> rows(count);
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

Eigen::MatrixXd settled(const Eigen::MatrixXd& table) {
  const auto result = llmt::without_rounding(table, every_row(table.rows()), 1);
  return result ? *result : table;
}

Eigen::Index different(const Eigen::MatrixXd& column) {
  return std::ssize(std::set<double>(column.reshaped().begin(), column.reshaped().end()));
}

// 0, 1, ..., 10 twice, the second time shifted. The 10 % and 90 % quantiles are 1 and 9.
Eigen::MatrixXd twice(double shift) {
  Eigen::MatrixXd x(22, 1);
  for (Eigen::Index i = 0; i < 11; ++i) {
    x(i, 0) = static_cast<double>(i);
    x(i + 11, 0) = static_cast<double>(i) + shift;
  }
  return x;
}

TEST(Rounding, ValuesWithinAMillionthOfTheSpreadAreEqual) {
  EXPECT_EQ(different(settled(twice(7.9e-6))), 11);
  EXPECT_EQ(different(settled(twice(-7.9e-6))), 11);
  EXPECT_EQ(different(settled(twice(8.1e-6))), 22);
  // A remote value does not make the others equal, nor do the largest numbers that there are.
  for (const double remote : {1e300, -1.7e308}) {
    Eigen::MatrixXd x = twice(8.1e-6);
    x(0, 0) = remote;
    EXPECT_EQ(different(settled(x)), 22);
  }
}

TEST(Rounding, ValuesBecomeTheSmallestAndTheLargestOnesStayTheRange) {
  const Eigen::MatrixXd x = twice(1e-6);
  const Eigen::MatrixXd y = settled(x);
  for (Eigen::Index i = 0; i < 10; ++i) {
    EXPECT_EQ(y(i, 0), static_cast<double>(i));
    EXPECT_EQ(y(i + 11, 0), static_cast<double>(i));
  }
  EXPECT_EQ(y(10, 0), 10.0 + 1e-6);
  EXPECT_EQ(y.maxCoeff(), x.maxCoeff());
  EXPECT_EQ(y.minCoeff(), x.minCoeff());
}

TEST(Rounding, ManyDifferentValuesStayAsTheyAre) {
  for (const Eigen::Index rows : {100, 3000, 200000}) {
    EXPECT_FALSE(llmt::without_rounding(oracle::uniform(rows, 1, 3), every_row(rows), 2)) << rows;
    EXPECT_FALSE(llmt::without_rounding(oracle::uniform(rows, 1, 3).array().cube().exp().matrix(), every_row(rows), 2))
        << rows;
  }
}

// Most values are 0, the others small but for one: they are no rounding of 0.
TEST(Rounding, SmallValuesBesideManyZerosAndARemoteOneStay) {
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(1000, 1);
  x.topRows(50) = 1e-3 * oracle::uniform(50, 1, 3);
  x(0, 0) = 1e4;
  EXPECT_FALSE(llmt::without_rounding(x, every_row(1000), 1));
}

TEST(Rounding, OnlyTheGivenRowsChangeAndMissingValuesStay) {
  Eigen::MatrixXd x = twice(1e-7);
  x(3, 0) = std::numeric_limits<double>::quiet_NaN();
  std::vector<Eigen::Index> rows = every_row(22);
  rows.erase(rows.begin() + 12);
  const auto y = llmt::without_rounding(x, rows, 1);
  ASSERT_TRUE(y);
  EXPECT_TRUE(std::isnan((*y)(3, 0)));
  EXPECT_EQ((*y)(12, 0), 1.0 + 1e-7);
  EXPECT_EQ((*y)(13, 0), 2.0);
}

// A column that was not checked yet keeps what will be refused.
TEST(Rounding, InfinityIsLeftForOthersToRefuse) {
  Eigen::MatrixXd x = twice(1e-7);
  x(21, 0) = x(20, 0) = x(19, 0) = x(18, 0) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(settled(x)(21, 0), std::numeric_limits<double>::infinity());
}

}  // namespace
