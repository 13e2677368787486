// Numbers that are taken for codes because held-out rows say so.
#include "fit/choices/code_choice.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "fit/choices/lack_of_fit.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "numerics/f_distribution.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"

namespace {

using llmt::Trend;
using oracle::Sample;

double number(llmt::Random& random, int low, int high) {
  return low + std::floor(random.uniform(0.0, 1.0) * (high - low + 1));
}

// x_0 in 2 ... 5 is a code, x_1 in 1 ... 6 an amount, x_2 and x_3 in 0 ... 1.
Sample coded(Eigen::Index rows, std::uint64_t seed, double amount = 0.4) {
  constexpr std::array of_code = {0.0, 1.5, -1.2, 0.8};
  llmt::Random random(seed);
  Sample data{Eigen::MatrixXd(rows, 4), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    data.x.row(i) << number(random, 2, 5), number(random, 1, 6), random.uniform(0.0, 1.0), random.uniform(0.0, 1.0);
    data.y(i, 0) = of_code[static_cast<std::size_t>(data.x(i, 0)) - 2] * (0.5 + data.x(i, 2)) +
                   amount * data.x(i, 1) * data.x(i, 2) + std::sin(3.0 * data.x(i, 3)) + 0.2 * random.normal();
  }
  return data;
}

// The same rows, whose numbers are no codes.
llmt::TrainingData as_numbers(const Sample& sample) {
  return {.inputs = sample.x, .outputs = sample.y, .may_have_codes = false};
}

std::string text_of(const llmt::FitResult& result) {
  std::string text = to_json(result.model);
  for (const llmt::Model& fold : result.intervals.models()) text += to_json(fold);
  return text;
}

TEST(CodeChoice, CodesAreFoundAndLowerTheError) {
  double chosen = 0.0;
  double numbers = 0.0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Sample train = coded(250, seed);
    const Sample test = coded(2000, seed + 100);
    const llmt::FitResult result = llmt::fit(train.x, train.y);
    EXPECT_EQ(result.summary.codes.taken, std::vector<int>{0}) << seed;
    EXPECT_EQ(result.model.inputs()[0].codes, (std::vector<double>{2, 3, 4, 5}));
    EXPECT_LT(result.summary.codes.rmse_as_codes, result.summary.codes.rmse_as_numbers);
    chosen += llmt::rmse(result.model.predict(test.x), test.y)(0);
    numbers += llmt::rmse(llmt::fit(as_numbers(train)).model.predict(test.x), test.y)(0);
  }
  EXPECT_LT(chosen, 0.95 * numbers);
}

TEST(CodeChoice, ModelIsThatOfCategories) {
  const Sample train = coded(250, 4);
  const llmt::FitResult result = llmt::fit(train.x, train.y);
  ASSERT_EQ(result.summary.codes.taken, std::vector<int>{0});
  Eigen::MatrixXd positions = train.x;
  positions.col(0).array() -= 2.0;
  const llmt::FitResult categories =
      llmt::fit({.inputs = positions, .outputs = train.y, .categorical_inputs = {0}, .may_have_codes = false});
  EXPECT_EQ(result.model.predict(train.x), categories.model.predict(positions));
  EXPECT_EQ(result.intervals.predict(train.x, 0.9).upper, categories.intervals.predict(positions, 0.9).upper);
}

TEST(CodeChoice, WithoutCodesTheModelIsThatOfNumbers) {
  llmt::Random random(5);
  Sample data = coded(300, 5);
  for (Eigen::Index i = 0; i < 300; ++i) data.y(i, 0) = 0.5 * data.x(i, 1) + data.x(i, 2) + 0.2 * random.normal();
  const llmt::FitResult result = llmt::fit(data.x, data.y);
  EXPECT_TRUE(result.summary.codes.compared.empty());
  EXPECT_EQ(text_of(result), text_of(llmt::fit(as_numbers(data))));
}

// A number that is an amount, bent, is compared, and stays a number.
TEST(CodeChoice, BentAmountsStayNumbers) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    llmt::Random random(seed);
    Sample data{Eigen::MatrixXd(400, 2), Eigen::MatrixXd(400, 1)};
    for (Eigen::Index i = 0; i < 400; ++i) {
      data.x.row(i) << number(random, 1, 10), random.uniform(0.0, 1.0);
      data.y(i, 0) = 2.0 * std::sqrt(data.x(i, 0)) * (0.5 + data.x(i, 1)) + 0.3 * random.normal();
    }
    const llmt::FitResult result = llmt::fit(data.x, data.y);
    EXPECT_TRUE(result.summary.codes.taken.empty()) << seed;
    EXPECT_FALSE(result.model.inputs()[0].is_categorical());
  }
}

TEST(CodeChoice, OnlyWholeNumbersOfAShortRangeWithEnoughRows) {
  const Sample train = coded(250, 6);
  const auto taken = [&](const Eigen::MatrixXd& x, const llmt::FitOptions& options = {}) {
    return llmt::fit(x, train.y, options).summary.codes.taken;
  };
  ASSERT_EQ(taken(train.x), std::vector<int>{0});
  Eigen::MatrixXd x = train.x;
  x.col(0) *= 0.5;  // not whole
  EXPECT_TRUE(taken(x).empty());
  x.col(0) = 4.0 * train.x.col(0);  // 8 ... 20
  EXPECT_TRUE(taken(x).empty());
  x.col(0) = 3.0 * train.x.col(0);  // 6 ... 15
  EXPECT_EQ(taken(x), std::vector<int>{0});
  x = train.x;
  x.col(0).head(9).setConstant(1.0);  // nine rows of one value
  EXPECT_TRUE(taken(x).empty());
  EXPECT_TRUE(taken(train.x, {.trends = {Trend::any, Trend::any, Trend::rising, Trend::any}}).empty());
  EXPECT_TRUE(taken(train.x, {.split_inputs = {0, 1, 2}}).empty());
  EXPECT_TRUE(taken(train.x, {.rule = llmt::GrowthRule::hilomot}).empty());
  EXPECT_TRUE(taken(train.x, {.folds = {.count = 0}}).empty());
}

// Rows of weight 0, missing values and a second output.
TEST(CodeChoice, TakesWhatAFitTakes) {
  Sample train = coded(800, 7);
  train.y.conservativeResize(Eigen::NoChange, 2);
  train.y.col(1) = 100.0 * train.y.col(0) + 5.0 * train.x.col(2);
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(800);
  for (int i = 0; i < 800; i += 60) train.x(i, 0) = std::nan("");
  for (int i = 5; i < 800; i += 20) {
    weights(i) = 0.0;
    train.x(i, 0) = 77.5;
  }
  for (const bool shared : {false, true}) {
    const llmt::FitOptions options{.shared_partition = shared};
    const llmt::FitResult result = llmt::fit({.inputs = train.x, .outputs = train.y, .weights = weights}, options);
    EXPECT_EQ(result.summary.codes.taken, std::vector<int>{0});
    EXPECT_TRUE(result.model.predict(train.x).allFinite());
  }
}

TEST(CodeChoice, SameBytesAtAnyNumberOfThreads) {
  const Sample train = coded(3000, 8);
  const std::string one = text_of(llmt::fit(train.x, train.y, {.max_threads = 1}));
  EXPECT_EQ(text_of(llmt::fit(train.x, train.y, {.max_threads = 3})), one);
}

TEST(LackOfFit, IsTheFTestOfTwoLeastSquares) {
  const Sample data = coded(120, 9);
  const llmt::LackOfFit lack(data.x, data.y);
  Eigen::MatrixXd with(120, 4 + 2);
  with.leftCols(4) = data.x;
  for (int k = 0; k < 2; ++k) with.col(4 + k) = (data.x.col(0).array() == 3.0 + k).cast<double>();
  const auto fewer = static_cast<double>(oracle::rss(data.x, data.y));
  const auto more = static_cast<double>(oracle::rss(with, data.y));
  const double expected = llmt::f_survival((fewer - more) / 2.0 / (more / (120.0 - 7.0)), 2.0, 113.0);
  EXPECT_NEAR(lack.p_value(data.x.col(0), {2, 3, 4, 5}), expected, 1e-9 + 1e-6 * expected);
  // Two values, and a column that others determine, say nothing new.
  EXPECT_EQ(lack.p_value((data.x.col(0).array() > 3.0).cast<double>(), {0, 1}) < 1.0, true);
  Eigen::MatrixXd doubled(120, 5);
  doubled << data.x, (data.x.col(0).array() > 3.0).cast<double>().matrix();
  EXPECT_EQ(llmt::LackOfFit(doubled, data.y).p_value(doubled.col(4), {0, 1}), 1.0);
}

// Of codes without any effect fewer than the level are bent.
TEST(LackOfFit, KeepsItsLevel) {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    llmt::Random random(seed);
    Sample data{Eigen::MatrixXd(60, 2), Eigen::MatrixXd(60, 1)};
    for (Eigen::Index i = 0; i < 60; ++i) {
      data.x.row(i) << number(random, 1, 5), random.uniform(0.0, 1.0);
      data.y(i, 0) = data.x(i, 0) + random.normal();
    }
    found += llmt::LackOfFit(data.x, data.y).p_value(data.x.col(0), {1, 2, 3, 4, 5}) < 0.05 ? 1 : 0;
  }
  EXPECT_NEAR(found, 20, 14);  // 400 * 0.05, three standard deviations
}

}  // namespace
