// From 500 to 4999 rows the printed error of a sum is of all rows, each predicted by trees that have not seen it.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "llmt/boosted.hpp"
#include "llmt/compare.hpp"
#include "llmt/random.hpp"
#include "llmt/statistics.hpp"
#include "oracles/oracles.hpp"

namespace {

// A step, a curve, noise of 0.3, and every 50th row off by 5: what a fifth of the rows says of the error depends on how
// many of those it has.
void draw(Eigen::Index rows, std::uint64_t seed, Eigen::MatrixXd& x, Eigen::MatrixXd& y) {
  llmt::Random random(seed);
  x.resize(rows, 3);
  y.resize(rows, 1);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (double& value : x.row(i)) value = random.uniform(-1.0, 1.0);
    const double gross = random.uniform(0.0, 1.0) < 0.02 ? 5.0 : 0.0;
    y(i, 0) = 2.0 * x(i, 0) * x(i, 0) + (x(i, 1) > 0.2 ? 1.0 : 0.0) + 0.3 * random.normal() + gross;
  }
}

TEST(AllFifths, TheErrorHardlyDependsOnTheSeed) {
  Eigen::MatrixXd x, y, new_x, new_y;
  draw(600, 3, x, y);
  draw(4000, 4, new_x, new_y);
  std::vector<double> printed, ratio;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    const llmt::BoostResult result = llmt::fit_boosted({.inputs = x, .outputs = y}, {.seed = seed});
    const llmt::BoostSummary& summary = result.summaries.front();
    EXPECT_EQ(summary.held_out, 600);
    EXPECT_GT(summary.spread, 0.0);
    printed.push_back(summary.rmse);
    ratio.push_back(summary.rmse / llmt::rmse(result.model.predict(new_x), new_y)(0));
  }
  // The error of single fifths varies by a fifth and more, that of all rows by a few per cent.
  const auto [least, most] = std::ranges::minmax(printed);
  EXPECT_LT(most / least, 1.1);
  for (const double each : ratio) {
    EXPECT_GT(each, 0.8);
    EXPECT_LT(each, 1.25);
  }
}

TEST(AllFifths, TheIntervalsAreOfAllRows) {
  Eigen::MatrixXd x, y;
  draw(700, 5, x, y);
  const llmt::BoostResult result = llmt::fit_boosted({.inputs = x, .outputs = y});
  std::size_t residuals = 0;
  const std::vector<llmt::SumResiduals>& parts = result.model.sums().front().held_out;
  for (const llmt::SumResiduals& part : parts) residuals += part.residuals.size();
  EXPECT_EQ(residuals, 700);
}

// Where the caller says which rows are held out, these alone judge.
TEST(AllFifths, AreNotAskedWhereTheHoldOutIsGiven) {
  Eigen::MatrixXd x, y;
  draw(700, 5, x, y);
  llmt::TrainingData data{.inputs = x, .outputs = y};
  for (Eigen::Index row = 0; row < 700; row += 7) data.held_out.push_back(row);
  const llmt::BoostResult result = llmt::fit_boosted(data);
  EXPECT_EQ(result.summaries.front().held_out, 100);
  EXPECT_EQ(result.summaries.front().spread, 0.0);
}

}  // namespace
