// Places that training rows leave empty.
#include "llmt/gaps.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "llmt/random.hpp"
#include "spread/fit_gaps.hpp"

namespace {

using IsInside = std::function<bool(const Eigen::RowVectorXd&)>;

// Rows from 0 to 1 in each input, none inside.
Eigen::MatrixXd rows_without(const IsInside& is_inside, Eigen::Index rows, int inputs, std::uint64_t seed) {
  llmt::Random random(seed);
  Eigen::MatrixXd x(rows, inputs);
  for (Eigen::Index i = 0; i < rows;) {
    for (double& value : x.row(i)) value = random.uniform();
    if (!is_inside(x.row(i))) ++i;
  }
  return x;
}

const IsInside nowhere = [](const Eigen::RowVectorXd&) { return false; };
const IsInside in_a_band = [](const Eigen::RowVectorXd& x) { return std::abs(x(0) - 0.5) < 0.1; };
const IsInside in_a_box = [](const Eigen::RowVectorXd& x) {
  return std::abs(x(0) - 0.55) < 0.15 && std::abs(x(1) - 0.5) < 0.2;
};
const IsInside in_a_corner = [](const Eigen::RowVectorXd& x) { return x(0) > 0.6 && x(1) > 0.6; };

// The shares of new rows in gaps, of those outside and inside.
Eigen::Vector2d shares_in(const std::vector<Eigen::Index>& in_gap, const IsInside& is_inside,
                          const Eigen::MatrixXd& fresh) {
  Eigen::Vector2d found = Eigen::Vector2d::Zero();
  Eigen::Vector2d rows = Eigen::Vector2d::Constant(1e-9);
  for (Eigen::Index i = 0; i < fresh.rows(); ++i) {
    const Eigen::Index side = is_inside(fresh.row(i)) ? 1 : 0;
    rows(side) += 1.0;
    found(side) += std::ranges::binary_search(in_gap, i) ? 1.0 : 0.0;
  }
  return found.array() / rows.array();
}

std::vector<int> all_columns(int inputs) {
  std::vector<int> columns;
  for (int j = 0; j < inputs; ++j) columns.push_back(j);
  return columns;
}

TEST(Gaps, AreFoundAmongTwoToSixInputs) {
  for (const int inputs : {2, 3, 6}) {
    for (const Eigen::Index rows : {500, 3000}) {
      const Eigen::MatrixXd fresh = rows_without(nowhere, 4000, inputs, 99);
      for (const IsInside& is_inside : {in_a_band, in_a_box, in_a_corner}) {
        const Eigen::MatrixXd x = rows_without(is_inside, rows, inputs, 3);
        const auto gaps = llmt::fit_gaps(x, all_columns(inputs));
        const Eigen::Vector2d shares = shares_in(llmt::rows_in_gaps(gaps, fresh), is_inside, fresh);
        EXPECT_GE(shares(1), 0.9) << inputs << " inputs, " << rows << " rows";
        EXPECT_LE(shares(0), 0.04) << inputs << " inputs, " << rows << " rows";
        EXPECT_TRUE(llmt::rows_in_gaps(gaps, x).empty());
        EXPECT_LE(gaps.size(), 50U);
        EXPECT_NO_THROW(llmt::check_gaps(gaps, inputs));
      }
    }
  }
}

// Of rows as the training rows are: independent, and along a line, which leaves most of the square empty.
TEST(Gaps, HoldFewOrdinaryRows) {
  for (const double noise : {1.0, 0.1}) {
    for (const Eigen::Index rows : {200, 2000}) {
      const auto made = [&](Eigen::Index count, std::uint64_t seed) {
        llmt::Random random(seed);
        Eigen::MatrixXd x(count, 4);
        for (Eigen::Index i = 0; i < count; ++i) {
          const double along = random.normal();
          for (double& value : x.row(i)) value = along + noise * random.normal();
        }
        return x;
      };
      const Eigen::MatrixXd fresh = made(4000, 5);
      double found = 0.0;
      for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        const auto gaps = llmt::fit_gaps(made(rows, 10 + seed), all_columns(4));
        found += static_cast<double>(llmt::rows_in_gaps(gaps, fresh).size()) / 12000.0;
      }
      EXPECT_LE(found, 0.025) << noise << " " << rows;
    }
  }
}

TEST(Gaps, AreInTheUnitsOfTheInputsAndIgnoreMissingValues) {
  Eigen::MatrixXd x = rows_without(in_a_band, 1000, 3, 6);
  x.col(0) = 1000.0 + 50.0 * x.col(0).array();
  x.col(2).setConstant(7.0);
  for (Eigen::Index i = 0; i < 1000; i += 9) x(i, 1) = std::numeric_limits<double>::quiet_NaN();
  const auto gaps = llmt::fit_gaps(x, {0, 1, 2});
  Eigen::MatrixXd asked(3, 3);
  asked << 1025.0, 0.5, 7.0, 1010.0, 0.5, 7.0, std::numeric_limits<double>::quiet_NaN(), 0.5, 7.0;
  EXPECT_EQ(llmt::rows_in_gaps(gaps, asked), (std::vector<Eigen::Index>{0}));
  EXPECT_TRUE(llmt::fit_gaps(x, {1, 2}).empty());
  EXPECT_TRUE(llmt::fit_gaps(x.topRows(99), {0, 1}).empty());  // too few rows to tell
}

// A new row of a hole is in a gap and its interval wider, by the tree and the sum, in memory and from a file.
TEST(Gaps, HaveValuesBetweenTheirEndsWhereManyRowsAreAtTheSmallestOne) {
  llmt::Random random(5);
  Eigen::MatrixXd x(400, 2);
  for (Eigen::Index i = 0; i < 400; ++i) x.row(i) << (i % 10 < 7 ? 0.0 : random.uniform()), random.uniform(-1.0, 1.0);
  const std::vector<llmt::Gap> gaps = llmt::fit_gaps(x, {0, 1});
  EXPECT_FALSE(gaps.empty());
  for (const llmt::Gap& gap : gaps) {
    for (const llmt::GapSide& side : gap.sides) EXPECT_LT(side.low, side.high);
  }
}

TEST(Gaps, MakeIntervalsWider) {
  const auto output = [](const Eigen::MatrixXd& x, std::uint64_t seed) {
    llmt::Random random(seed);
    Eigen::MatrixXd y(x.rows(), 1);
    for (Eigen::Index i = 0; i < x.rows(); ++i) y(i, 0) = x(i, 0) + 2.0 * x(i, 1) + 0.1 * random.normal();
    return y;
  };
  const Eigen::MatrixXd x = rows_without(in_a_box, 1500, 2, 7);
  const Eigen::MatrixXd fresh = rows_without(nowhere, 3000, 2, 8);
  const llmt::FitResult tree = llmt::fit(x, output(x, 9));
  const llmt::BoostedModel sum = llmt::fit_boosted({.inputs = x, .outputs = output(x, 9)}).model;
  const auto read = llmt::from_json_with_intervals(llmt::to_json(tree.model, tree.intervals));
  EXPECT_EQ(read.intervals.gaps(), tree.intervals.gaps());
  const llmt::BoostedModel read_sum = llmt::boosted_from_json(llmt::to_json(sum));
  EXPECT_EQ(read_sum.gaps(), sum.gaps());
  for (const llmt::Bounds& bounds : {tree.intervals.predict(fresh, 0.9), sum.intervals(fresh, 0.9),
                                     read.intervals.predict(fresh, 0.9), read_sum.intervals(fresh, 0.9)}) {
    const Eigen::Vector2d shares = shares_in(bounds.in_gap, in_a_box, fresh);
    EXPECT_GE(shares(1), 0.9);
    EXPECT_LE(shares(0), 0.03);
    double inside = 0.0;
    double outside = 0.0;
    for (Eigen::Index i = 0; i < fresh.rows(); ++i) {
      const bool is_in = std::ranges::binary_search(bounds.in_gap, i);
      const auto count = static_cast<double>(bounds.in_gap.size());
      const double width = bounds.upper(i, 0) - bounds.lower(i, 0);
      (is_in ? inside : outside) += width / (is_in ? count : 3000.0 - count);
    }
    EXPECT_GT(inside, 1.35 * outside);  // of normal errors 2.58 / 1.64 = 1.57
    EXPECT_LT(inside, 2.5 * outside);
  }
}

TEST(Gaps, ThatFitNoModelAreRefused) {
  const double endless = std::numeric_limits<double>::infinity();
  EXPECT_NO_THROW(llmt::check_gaps({{{{0, 1.0, 2.0}, {1, -1.0, 0.0}}}}, 2));
  for (const llmt::GapSide& bad : {llmt::GapSide{2, 1.0, 2.0}, {-1, 1.0, 2.0}, {0, 1.0, 1.0}, {0, -endless, 1.0}}) {
    EXPECT_THROW(llmt::check_gaps({{{bad}}}, 2), std::invalid_argument);
  }
  EXPECT_THROW(llmt::check_gaps({llmt::Gap{}}, 2), std::invalid_argument);
}

TEST(Gaps, EndAtTheirEnds) {
  const llmt::Gap gap{{{.column = 1, .low = 0.0, .high = 1.0}}};
  Eigen::MatrixXd x(3, 2);
  x << 9.0, 0.0, 9.0, 0.5, 9.0, 1.0;
  EXPECT_EQ(llmt::rows_in_gaps({gap}, x), (std::vector<Eigen::Index>{1}));
}

}  // namespace
