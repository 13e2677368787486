// Rows that repeat other rows.
#include "data/equal_rows.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <vector>

#include "llmt/compare.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "oracles/oracles.hpp"

namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

std::vector<Eigen::Index> all_of(Eigen::Index count) {
  std::vector<Eigen::Index> rows(count);
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

bool repeats(const Eigen::MatrixXd& x, const std::vector<Eigen::Index>& rows) {
  return llmt::find_equal_rows(x, rows, llmt::number_rows(x, oracle::uniform(x.rows(), 1, 99), rows)).are_repeats;
}

Eigen::MatrixXd times(const Eigen::MatrixXd& table, Eigen::Index count) { return table.replicate(count, 1); }

TEST(EqualRows, AreNumberedAsAMapDoes) {
  llmt::Random random(1);
  Eigen::MatrixXd table(400, 3);
  const std::vector<double> values = {0.0, -0.0, 1.0, 2.0, missing, -missing};
  for (double& value : table.reshaped()) value = values[static_cast<std::size_t>(random.uniform(0.0, 6.0))];
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < 400; row += 1 + row % 3) rows.push_back(row);
  std::map<std::vector<double>, int> seen;
  std::vector<int> expected;
  for (const Eigen::Index row : rows) {
    std::vector<double> key;
    for (const int j : {0, 2}) key.push_back(std::isnan(table(row, j)) ? 99.0 : table(row, j));
    expected.push_back(seen.emplace(key, static_cast<int>(seen.size())).first->second);
  }
  EXPECT_EQ(llmt::number_different_rows(table, rows, {0, 2}), expected);
}

TEST(EqualRows, OfNumbersAreRepeatsAndOfFewValuesAreNot) {
  const Eigen::MatrixXd x = oracle::uniform(300, 4, 1);
  EXPECT_FALSE(repeats(x, all_of(300)));
  EXPECT_TRUE(repeats(times(x, 2), all_of(600)));
  EXPECT_TRUE(repeats(times(x.leftCols(1), 3), all_of(900)));
  // Four questions with five answers each.
  const Eigen::MatrixXd answers = (2.5 * (oracle::uniform(1000, 4, 2).array() + 1.0)).floor();
  EXPECT_FALSE(repeats(answers, all_of(1000)));
  // Rows drawn with replacement.
  Eigen::MatrixXd drawn(300, 4);
  llmt::Random random(3);
  for (Eigen::Index i = 0; i < 300; ++i) {
    drawn.row(i) = x.row(static_cast<Eigen::Index>(random.uniform(0.0, 300.0)));
  }
  EXPECT_TRUE(repeats(drawn, all_of(300)));
}

TEST(EqualRows, AnInputOfFewValuesBesideNumbersHidesNoRepeats) {
  Eigen::MatrixXd x = oracle::uniform(300, 4, 1);
  x.leftCols(3) = x.leftCols(3).array().sign();
  EXPECT_FALSE(repeats(x, all_of(300)));
  EXPECT_TRUE(repeats(times(x, 2), all_of(600)));
}

TEST(EqualRows, ATableTwiceOrThreeTimesGivesTheModelOfTheTableOnce) {
  const Eigen::MatrixXd x = oracle::uniform(250, 3, 5);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1, 5);
  const llmt::FitResult once = llmt::fit(x, y);
  for (const Eigen::Index count : {2, 3}) {
    const llmt::FitResult copied = llmt::fit(times(x, count), times(y, count));
    EXPECT_EQ(llmt::to_json(copied.model), llmt::to_json(once.model));
    EXPECT_EQ(copied.summary.partitions[0].chosen.rmse, once.summary.partitions[0].chosen.rmse);
    EXPECT_FALSE(copied.summary.repeats);
    EXPECT_EQ(copied.summary.copies, 250 * (count - 1));
    EXPECT_EQ(copied.summary.samples, 250 * count);
  }
  EXPECT_FALSE(once.summary.repeats);
}

TEST(EqualRows, CellsOfFewValuesWrittenTwiceAreLeftAsTheyWereOnce) {
  const Eigen::MatrixXd x = (2.5 * (oracle::uniform(500, 4, 2).array() + 1.0)).floor();
  const Eigen::MatrixXd y = (oracle::curved(x, 1.0, 3).array() * 0.5).round();
  const llmt::FitResult once = llmt::fit(x, y);
  EXPECT_FALSE(once.summary.repeats);
  EXPECT_EQ(once.summary.copies, 0);
  const llmt::FitResult twice = llmt::fit(times(x, 2), times(y, 2));
  EXPECT_FALSE(twice.summary.repeats);
  EXPECT_EQ(twice.summary.copies, 500);
  EXPECT_EQ(llmt::to_json(twice.model), llmt::to_json(once.model));
}

TEST(EqualRows, ATableWithSomeCopiesOfItsOwnIsReadAsWrittenOnce) {
  Eigen::MatrixXd x = oracle::uniform(250, 3, 5);
  Eigen::MatrixXd y = oracle::curved(x, 0.1, 5);
  x.topRows(12) = x.bottomRows(12).eval();
  y.topRows(12) = y.bottomRows(12).eval();
  const llmt::FitResult once = llmt::fit(x, y);
  EXPECT_EQ(once.summary.copies, 0);
  const llmt::FitResult twice = llmt::fit(times(x, 2), times(y, 2));
  EXPECT_EQ(twice.summary.copies, 250);
  EXPECT_EQ(llmt::to_json(twice.model), llmt::to_json(once.model));
}

TEST(EqualRows, CopiesCountAsTheSumOfTheirWeights) {
  const Eigen::MatrixXd x = oracle::uniform(250, 3, 5);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1, 5);
  const Eigen::VectorXd weights = Eigen::VectorXd::LinSpaced(250, 1.0, 4.0);
  const llmt::FitResult once = llmt::fit({.inputs = x, .outputs = y, .weights = weights});
  llmt::TrainingData twice{.inputs = times(x, 2), .outputs = times(y, 2), .weights = weights.replicate(2, 1)};
  twice.weights.head(250) *= 0.25;  // a quarter and three quarters, doubled
  twice.weights.tail(250) *= 0.75;
  EXPECT_LT((llmt::fit(twice).model.predict(x) - once.model.predict(x)).norm(), 1e-9);
  // A copy of weight 0 takes no part.
  twice.weights.tail(250).setZero();
  EXPECT_EQ(llmt::fit(twice).summary.copies, 0);
}

// Every point has a deviation of its own, which all its measurements share.
TEST(EqualRows, HeldOutErrorOfRepeatedMeasurementsIsThatOfNewPoints) {
  const Eigen::MatrixXd points = oracle::uniform(200, 2, 7);
  const Eigen::MatrixXd x = times(points, 4);
  const Eigen::MatrixXd y = times(oracle::curved(points, 1.0, 7), 4) + 0.01 * oracle::uniform(800, 1, 8);
  const llmt::FitResult result = llmt::fit(x, y);
  EXPECT_TRUE(result.summary.repeats);
  EXPECT_EQ(result.summary.copies, 0);
  const Eigen::MatrixXd fresh = oracle::uniform(2000, 2, 9);
  const double error = llmt::rmse(result.model.predict(fresh), oracle::curved(fresh, 1.0, 9))(0);
  EXPECT_NEAR(result.summary.partitions[0].chosen.rmse / error, 1.0, 0.15);
  const llmt::ComparisonResult compared = llmt::compare(x, y, {{.name = "usual", .options = {}}}, {});
  EXPECT_NEAR(compared.methods[0].cv_rmse / error, 1.0, 0.15);
}

TEST(EqualRows, FewRepeatedPointsAreComparedOnAsManyFolds) {
  const Eigen::MatrixXd x = times(Eigen::VectorXd::LinSpaced(12, 0.0, 1.0), 4);
  const Eigen::MatrixXd y = x + 0.1 * oracle::uniform(48, 1, 5);
  llmt::CompareOptions options;
  options.folds.count = 20;
  const llmt::ComparisonResult compared = llmt::compare(x, y, {{.name = "usual", .options = {}}}, options);
  EXPECT_EQ(compared.methods[0].fold_rmse.size(), 12);
  // Nine points are too few to tell.
  EXPECT_FALSE(repeats(times(Eigen::VectorXd::LinSpaced(9, 0.0, 1.0), 4), all_of(36)));
}

TEST(EqualRows, GroupsOfTheCallerAreUsedAsTheyAre) {
  const Eigen::MatrixXd x = oracle::uniform(100, 2, 5);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1, 5);
  std::vector<double> groups(200);
  std::iota(groups.begin(), groups.end(), 0.0);
  const llmt::FitResult result = llmt::fit({.inputs = times(x, 2), .outputs = times(y, 2), .groups = groups});
  EXPECT_FALSE(result.summary.repeats);
  EXPECT_EQ(result.summary.copies, 0);
}

TEST(EqualRows, TukeysLossWeighsEveryCopy) {
  const Eigen::MatrixXd x = oracle::uniform(250, 2, 5);
  Eigen::MatrixXd y = oracle::curved(x, 0.1, 5);
  y(7, 0) += 1e4;
  const llmt::FitResult result = llmt::fit(times(x, 2), times(y, 2), {.loss = llmt::Loss::tukey});
  const Eigen::VectorXd& weights = result.summary.loss_weights;
  EXPECT_EQ(weights.head(250), weights.tail(250));
  EXPECT_EQ(weights(7), 0.0);
  EXPECT_GT(weights.mean(), 0.8);
}

}  // namespace
