// Intervals of sums of trees.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include "llmt/boosted.hpp"
#include "oracles/friedman.hpp"
#include "study.hpp"

namespace {

using oracle::friedman;

// Shares of new rows within the intervals, in fifths by their predictions, and of all rows.
std::vector<double> coverage(std::uint64_t seed, double level) {
  const llmt::BoostedModel model = llmt::fit_boosted(friedman(600, seed), {.seed = seed}).model;
  const llmt::TrainingData fresh = friedman(2000, seed + 1000);
  const Eigen::VectorXd predicted = model.predict(fresh.inputs);
  const llmt::Bounds bounds = model.intervals(fresh.inputs, level);
  std::vector<Eigen::Index> order(2000);
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&](Eigen::Index row) { return predicted(row); });
  std::vector<double> inside(6, 0.0);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const double output = fresh.outputs(order[k], 0);
    if (output < bounds.lower(order[k], 0) || output > bounds.upper(order[k], 0)) continue;
    inside[k / 400] += 1.0 / 400.0;
    inside[5] += 1.0 / 2000.0;
  }
  return inside;
}

// One set of 120 residuals moves the coverage by sqrt(0.9 * 0.1 / 120) = 0.027, the mean of 10 by 0.009. That the sum
// of all rows is better than the trees of the residuals, and that these rows stopped them, moves it by about as much.
TEST(BoostedModel, HasIntervalsThatHoldTheLevelInEveryFifth) {
  std::vector<double> mean(6, 0.0);
  const int seeds = sampled(10, 4);
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    const std::vector<double> inside = coverage(seed, 0.9);
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += inside[k] / seeds;
  }
  EXPECT_NEAR(mean[5], 0.9, 0.03);
  for (std::size_t fifth = 0; fifth < 5; ++fifth) EXPECT_NEAR(mean[fifth], 0.9, 0.05) << fifth;
}

TEST(BoostedModel, HasHalfWidthsThatAreOrderStatisticsOfResiduals) {
  llmt::BoostedSum sum{.base = 1.0, .features = {{.inputs = {0}}}, .trees = {}};
  const auto with = [&](std::vector<llmt::SumResiduals> held_out) {
    sum.held_out = std::move(held_out);
    return llmt::BoostedModel({{.name = "x", .low = 0.0, .high = 1.0}}, {{.name = "y", .low = 0.0, .high = 1.0}}, {1.0},
                              {sum});
  };
  const auto half_width = [](const llmt::BoostedModel& model, double level, double x = 0.0) {
    const llmt::Bounds bounds = model.intervals(Eigen::MatrixXd::Constant(1, 1, x), level);
    EXPECT_EQ(bounds.lower(0, 0) + bounds.upper(0, 0), 2.0);
    return bounds.upper(0, 0) - 1.0;
  };
  const llmt::BoostedModel model = with({{{1, 2, 3, 4, 5, 6, 7, 8, 9}}});
  EXPECT_EQ(half_width(model, 0.9), 9.0);
  EXPECT_EQ(half_width(model, 0.5), 5.0);
  EXPECT_EQ(half_width(model, 0.41), 5.0);
  EXPECT_EQ(half_width(model, 0.01), 1.0);
  EXPECT_THROW(half_width(model, 0.91), std::invalid_argument);
  EXPECT_THROW(half_width(model, 1.0), std::invalid_argument);
  EXPECT_FALSE(with({}).has_intervals());
  EXPECT_THROW(half_width(with({}), 0.5), std::invalid_argument);
  EXPECT_THROW(with({{{2.0, 1.0}}}), std::invalid_argument);
  EXPECT_THROW(with({{{-1.0}}}), std::invalid_argument);
  // Two parts: the second one says that errors are four times as large where x > 0.5.
  const llmt::Spread spread{
      .nodes = {{.column = 0, .threshold = 0.5, .left = 1, .right = 2}, {.factor = 0.5}, {.factor = 2.0}},
      .levels = {{}}};
  const llmt::BoostedModel two = with({{{1, 2, 3, 4, 5}}, {{2, 4, 6, 8}, spread}});
  EXPECT_EQ(half_width(two, 0.5, 0.5), 3.0);  // 1 1 2 2 3 3 4 4 5
  EXPECT_EQ(half_width(two, 0.5, 0.6), 4.0);  // 1 2 3 4 4 5 8 12 16
  EXPECT_EQ(half_width(two, 0.9, 0.6), 16.0);
}

// Of rows that are many enough a residual is that of a row, by the spread there.
TEST(FitBoosted, KeepsTheResidualsOfHeldOutRows) {
  for (const Eigen::Index held_out : {60, 120}) {
    llmt::TrainingData data = friedman(400, 8);
    for (Eigen::Index row = 0; row < held_out; ++row) data.held_out.push_back(row);
    const llmt::BoostedModel model = llmt::fit_boosted(data, {.max_rounds = 40}).model;
    const Eigen::VectorXd predicted = model.predict(data.inputs).topRows(held_out);
    Eigen::Index found = 0;
    for (const llmt::SumResiduals& part : model.sums()[0].held_out) {
      for (Eigen::Index row = 0; row < held_out; ++row) {
        const double expected = std::abs(predicted(row) - data.outputs(row, 0)) /
                                llmt::spread_at(part.spread, data.inputs, row, predicted(row));
        found += std::ranges::any_of(part.residuals, [&](double each) { return std::abs(each - expected) < 1e-4; });
      }
    }
    EXPECT_GE(found, held_out);
  }
}

}  // namespace
