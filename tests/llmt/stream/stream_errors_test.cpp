// What streams make of errors, by hand and by sums over all rows: docs/algorithms/stream.md.
#include "stream/detectors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "llmt/random.hpp"
#include "llmt/stream.hpp"
#include "oracles/oracles.hpp"
#include "oracles/stream_data.hpp"
#include "stream/sums.hpp"

namespace {

// 50 rows near a threshold of 0.5 that is watched in bins of 0.01, the first `wrong` of them in the three bins on one
// side and predicted better by the other side's subtree, by `squared`; returns where the threshold then is.
double threshold_after(int wrong, double side, double squared) {
  llmt::ThresholdWatch watch(0.5, 0.16);
  double threshold = 0.5;
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(threshold, 0.5) << i;
    const double x = 0.5 + side * (0.005 + 0.01 * (i % 3));
    const double of_own_side = i < wrong ? squared : 0.0;
    threshold = watch.add(x, side < 0.0 ? of_own_side : 0.0, side < 0.0 ? 0.0 : of_own_side);
  }
  return threshold;
}

TEST(ThresholdWatch, MovesToTheNearestEdgeBehindTheRowsOnTheWrongSide) {
  for (const double squared : {1.0, 1e-8, 1e8}) {
    EXPECT_NEAR(threshold_after(50, -1.0, squared), 0.47, 1e-12) << squared;
    EXPECT_NEAR(threshold_after(50, 1.0, squared), 0.53, 1e-12) << squared;
    // Four standard errors: 17 > 4 sqrt(17), and 15 < 4 sqrt(15).
    EXPECT_NEAR(threshold_after(17, -1.0, squared), 0.47, 1e-12) << squared;
    EXPECT_NEAR(threshold_after(17, 1.0, squared), 0.53, 1e-12) << squared;
    EXPECT_EQ(threshold_after(15, -1.0, squared), 0.5) << squared;
    EXPECT_EQ(threshold_after(15, 1.0, squared), 0.5) << squared;
  }
}

TEST(ThresholdWatch, LooksAtHalfTheRangeAfterTwoHundredRows) {
  llmt::ThresholdWatch watch(0.5, 0.16);
  for (int i = 0; i < 200; ++i) {
    EXPECT_TRUE(watch.concerns(0.659)) << i;
    EXPECT_FALSE(watch.concerns(0.661)) << i;
    watch.add(0.55, 1.0, 1.0);
  }
  EXPECT_TRUE(watch.concerns(0.579));
  EXPECT_TRUE(watch.concerns(0.421));
  EXPECT_FALSE(watch.concerns(0.581));
  EXPECT_FALSE(watch.concerns(0.419));
}

TEST(Duel, IsTheMeanDifferenceInStandardErrorsOverAboutTheLastFiveHundredRows) {
  llmt::Random random(1);
  llmt::Duel duel;
  std::vector<double> differences;
  for (int i = 0; i < 900; ++i) {
    const double first = std::abs(random.normal());
    const double second = std::abs(random.normal()) + (i < 400 ? 0.3 : -0.1);
    duel.add(first, second);
    differences.push_back(first - second);
    if (i % 100 != 99) continue;
    double weight = 0.0;
    double sum = 0.0;
    double squares = 0.0;
    for (int k = 0; k <= i; ++k) {
      const double of_row = std::pow(1.0 - 1.0 / 500.0, i - k);
      weight += of_row;
      sum += of_row * differences[k];
      squares += of_row * differences[k] * differences[k];
    }
    const double mean = sum / weight;
    EXPECT_NEAR(duel.t(), mean / std::sqrt((squares / weight - mean * mean) / weight), 1e-9) << i;
    EXPECT_EQ(duel.rows(), i + 1);
  }
}

// Rows from the first large error to the alarm.
int rows_to_alarm(int before, double error) {
  llmt::RiseDetector detector;
  for (int i = 0; i < before; ++i) EXPECT_FALSE(detector.add(1.0)) << i;
  int rows = 1;
  while (!detector.add(error) && rows < 10000) ++rows;
  return rows;
}

TEST(RiseDetector, RaisesTheAlarmAsTheSumOfTheExcessesSays) {
  // However large, an error counts as 4 units: 27 x (4 - 1.1) = 78.3, 28 x 2.9 = 81.2 > 80.
  EXPECT_EQ(rows_to_alarm(300, 1e9), 28);
  EXPECT_EQ(rows_to_alarm(20000, 1e9), 28);
  EXPECT_EQ(rows_to_alarm(299, 1e9), 29);  // the first 300 rows only say what is usual
  // Errors of 2 become usual: after k of them the mean over 5000 rows is 2 - (1 - 1/5000)^k.
  double sum = 0.0;
  int rows = 0;
  while (sum <= 80.0) sum += 2.0 / (2.0 - std::pow(1.0 - 1.0 / 5000.0, rows++)) - 1.1;
  EXPECT_EQ(rows_to_alarm(20000, 2.0), rows);
  EXPECT_EQ(rows_to_alarm(20000, 1.05), 10000);
}

// Every row is predicted before it is learned. The recent error forgets, over 1000 rows.
TEST(Stream, ErrorsAreThoseOfPredictionsBeforeLearning) {
  const Eigen::MatrixXd x = oracle::uniform(2500, 2, 1);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1);
  llmt::Stream stream(2, 1, {.reservoir_rows = 0});
  double squares = 0.0;
  double recent = 0.0;
  int tested = 0;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (i >= 50) {  // the trees begin with 50 rows
      const double error = stream.predict(x.row(i))(0, 0) - y(i, 0);
      ++tested;
      squares += error * error;
      recent += (error * error - recent) / std::min(tested, 1000);
    }
    stream.add(x.row(i), y.row(i));
  }
  EXPECT_NEAR(stream.prequential_rmse()(0), std::sqrt(squares / tested), 1e-9);
  EXPECT_NEAR(stream.recent_rmse()(0), std::sqrt(recent), 1e-9);
}

// A missing value counts as the mean of the rows before the trees.
TEST(Stream, PredictsAtAMissingValueAsAtTheMean) {
  const Eigen::MatrixXd x = oracle::uniform(300, 2, 1);
  llmt::Stream stream(2, 1, {.reservoir_rows = 0});
  stream.add(x, 3.0 * x.col(0) - x.col(1));
  Eigen::MatrixXd query(2, 2);
  query << std::nan(""), 0.3, x.col(0).head(50).mean(), 0.3;
  const Eigen::MatrixXd predicted = stream.predict(query);
  EXPECT_NEAR(predicted(0, 0), predicted(1, 0), 1e-9);
}

// The first test of a leaf asks for a p value of half of the significance, over all inputs and edges.
TEST(Stream, NoiseHardlyEverPassesTheFirstTest) {
  int tested = 0;
  int passed = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    llmt::Stream stream(2, 1, {.reservoir_rows = 0});
    Eigen::MatrixXd noise(200, 1);
    llmt::Random random(seed);
    for (double& value : noise.reshaped()) value = random.normal();
    stream.add(oracle::uniform(200, 2, 100 + seed), noise);
    const auto search = nlohmann::ordered_json::parse(to_json(stream))["trees"][0]["nodes"][0]["search"];
    tested += search["tests"] > 0 ? 1 : 0;
    passed += search["first_passed"] > 0 ? 1 : 0;
  }
  EXPECT_GE(tested, 35);
  EXPECT_LE(passed, 6);  // more than 6 of 40 with a probability of 0.05 come in 0.3 % of such samples
}

// A change in one region raises the alarm there; the nodes above, which have seen it too, begin to watch anew.
TEST(Stream, AnAlarmBelowIsNoneAbove) {
  const Eigen::MatrixXd x = oracle::uniform(12000, 2, 1);
  Eigen::MatrixXd y = stream_data::kink(x) + 0.1 * stream_data::noise(12000, 2);
  for (Eigen::Index i = 6000; i < 12000; ++i) y(i, 0) += x(i, 0) < -0.5 ? 1.0 : 0.0;
  llmt::Stream stream(2, 1);
  stream.add(x.topRows(6000), y.topRows(6000));
  ASSERT_EQ(stream.counts().drifts, 0);
  Eigen::Index rows = 6000;
  for (; rows < 12000 && stream.counts().drifts == 0; ++rows) stream.add(x.row(rows), y.row(rows));
  ASSERT_EQ(stream.counts().drifts, 1);
  const auto root = nlohmann::ordered_json::parse(to_json(stream))["trees"][0]["nodes"][0];
  ASSERT_TRUE(root.contains("split"));
  ASSERT_FALSE(root.contains("alternate"));  // it was not the root that raised it
  EXPECT_EQ(root["rise"]["rows"], 0);
}

TEST(StreamSums, WhatRemainsIsTheResidualSumOfSquares) {
  const Eigen::MatrixXd x = oracle::uniform(80, 2, 1);
  const llmt::GramShape shape(3, 1);
  const llmt::Basis basis{Eigen::Vector2d(0.1, -0.2), Eigen::Vector3d(1.0, 0.5, -0.5)};
  const auto remaining_of = [&](const Eigen::MatrixXd& y) {
    llmt::RowProducts products(shape);
    std::vector<double> gram(shape.size(), 0.0);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const Eigen::VectorXd row = x.row(i).transpose();
      products.set(basis, row.data(), y(i, 0), 1.0);
      products.add_to(gram.data());
    }
    int rank = 0;
    return llmt::remaining(shape, gram.data(), llmt::solve(shape, gram.data(), 0.0, rank));
  };
  const Eigen::MatrixXd curved = oracle::curved(x);
  EXPECT_NEAR(remaining_of(curved), static_cast<double>(oracle::rss(x, curved)), 1e-10);
  EXPECT_NEAR(remaining_of(stream_data::affine(x)), 0.0, 1e-10);
}

// A snapshot's blend has a coefficient for every ten rows of the sample at most.
TEST(Stream, ASmallSampleMakesASmallBlend) {
  const Eigen::MatrixXd x = oracle::uniform(20000, 3, 1);
  llmt::Stream stream(3, 1, {.reservoir_rows = 200});
  stream.add(x, oracle::curved(x, 0.05));
  ASSERT_GT(stream.counts().leaves, 10);
  EXPECT_LE(stream.snapshot(llmt::ValidityChoice::blend).partitions()[0].num_leaves(), 200 / (10 * 4));
}

}  // namespace
