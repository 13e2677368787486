// Inputs that are left out because held-out rows say so.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/model.hpp"
#include "llmt/random.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"

namespace {

using oracle::Sample;

// Friedman (1991) on [0, 1]: five of the inputs matter; noise of standard deviation 1.
Sample friedman(Eigen::Index rows, Eigen::Index inputs, std::uint64_t seed) {
  Sample data{(oracle::uniform(rows, inputs, seed).array() + 1.0) / 2.0, Eigen::MatrixXd(rows, 1)};
  llmt::Random random(seed + 1000);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto x = data.x.row(i);
    data.y(i, 0) = 10.0 * std::sin(std::numbers::pi * x(0) * x(1)) + 20.0 * (x(2) - 0.5) * (x(2) - 0.5) + 10.0 * x(3) +
                   5.0 * x(4) + random.normal();
  }
  return data;
}

llmt::FitOptions all_inputs() { return {.choose_inputs = false}; }

double test_rmse(const llmt::Model& model, const Sample& test) { return llmt::rmse(model.predict(test.x), test.y)(0); }

TEST(InputChoice, UsefulInputsStayAndUselessOnesCostLittle) {
  double with = 0.0;
  double without = 0.0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Sample train = friedman(250, 20, seed);
    const Sample test = friedman(2000, 20, seed + 100);
    const llmt::FitResult chosen = llmt::fit(train.x, train.y);
    for (const int input : chosen.summary.partitions[0].left_out) EXPECT_GE(input, 5) << seed;
    EXPECT_GE(chosen.summary.partitions[0].left_out.size(), 10U) << seed;
    EXPECT_LE(std::ssize(chosen.model.regressors()), 10);
    with += test_rmse(chosen.model, test);
    without += test_rmse(llmt::fit(train.x, train.y, all_inputs()).model, test);
  }
  EXPECT_LT(with, 0.75 * without);
}

TEST(InputChoice, AProductOfTwoInputsIsFoundAlthoughNeitherHasAnEffectAlone) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Eigen::MatrixXd x = oracle::uniform(300, 15, seed);
    const Eigen::MatrixXd y = x.col(7).cwiseProduct(x.col(11));
    const llmt::PartitionSummary summary = llmt::fit(x, y).summary.partitions[0];
    EXPECT_GE(summary.left_out.size(), 8U) << seed;
    for (const int input : summary.left_out) EXPECT_TRUE(input != 7 && input != 11) << seed;
  }
}

// A choice that had seen the held-out rows would promise less than the noise: by a tenth, over these samples.
TEST(InputChoice, HeldOutErrorOfNoiseIsThatOfNewRows) {
  double promised = 0.0;
  double kept = 0.0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    llmt::Random random(seed);
    const auto normal = [&](Eigen::Index rows) {
      Eigen::MatrixXd values(rows, 1);
      for (double& value : values.reshaped()) value = random.normal();
      return values;
    };
    const Sample train{oracle::uniform(100, 25, seed), normal(100)};
    const Sample test{oracle::uniform(2000, 25, seed + 50), normal(2000)};
    const llmt::FitResult result = llmt::fit(train.x, train.y);
    promised += result.summary.partitions[0].chosen.rmse;
    kept += test_rmse(result.model, test);
  }
  EXPECT_GT(promised, 0.95 * kept);
}

TEST(InputChoice, NothingIsLostWhereAllInputsMatter) {
  double with = 0.0;
  double without = 0.0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    llmt::Random random(seed);
    Sample train{oracle::uniform(120, 12, seed), Eigen::MatrixXd(120, 1)};
    Sample test{oracle::uniform(1000, 12, seed + 9), Eigen::MatrixXd(1000, 1)};
    for (Sample* data : {&train, &test}) {
      for (Eigen::Index i = 0; i < data->x.rows(); ++i) data->y(i, 0) = data->x.row(i).sum() + random.normal();
    }
    with += test_rmse(llmt::fit(train.x, train.y).model, test);
    without += test_rmse(llmt::fit(train.x, train.y, all_inputs()).model, test);
  }
  EXPECT_LT(with, 1.03 * without);
}

// Each output has a tree of its own, with inputs of its own: the model of both is the two models side by side.
TEST(InputChoice, SeveralOutputsHaveTheirOwnInputs) {
  Sample data = friedman(200, 12, 5);
  data.y.conservativeResize(200, 2);
  llmt::Random random(3);
  for (Eigen::Index i = 0; i < 200; ++i) {
    data.y(i, 1) = std::sin(6.0 * data.x(i, 10)) + 2.0 * data.x(i, 11) + 0.1 * random.normal();
  }
  const llmt::FitResult both = llmt::fit(data.x, data.y);
  ASSERT_NE(both.summary.partitions[0].left_out, both.summary.partitions[1].left_out);
  const Eigen::MatrixXd queries = (oracle::uniform(300, 12, 77).array() + 1.0) / 2.0;
  for (const int output : {0, 1}) {
    const llmt::FitResult alone = llmt::fit(data.x, data.y.col(output));
    EXPECT_EQ(alone.summary.partitions[0].left_out, both.summary.partitions[output].left_out);
    EXPECT_FALSE(alone.summary.partitions[0].left_out.empty());
    const Eigen::VectorXd difference = alone.model.predict(queries).col(0) - both.model.predict(queries).col(output);
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-9);
    const llmt::Bounds bounds = alone.intervals.predict(queries, 0.9);
    const llmt::Bounds of_both = both.intervals.predict(queries, 0.9);
    EXPECT_LT((bounds.lower.col(0) - of_both.lower.col(output)).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((alone.model.standard_errors(queries).col(0) - both.model.standard_errors(queries).col(output))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-9);
  }
  EXPECT_EQ(llmt::to_json(llmt::from_json(llmt::to_json(both.model))), llmt::to_json(both.model));
}

TEST(InputChoice, ACategoricalInputIsOneInput) {
  Sample data = friedman(250, 12, 8);
  for (Eigen::Index i = 0; i < 250; ++i) {
    data.x(i, 10) = static_cast<double>(i % 4);  // matters
    data.x(i, 11) = static_cast<double>((i / 4) % 3);
    data.y(i, 0) += 4.0 * static_cast<double>(i % 4 == 2);
  }
  const llmt::PartitionSummary summary =
      llmt::fit({.inputs = data.x, .outputs = data.y, .categorical_inputs = {10, 11}}).summary.partitions[0];
  EXPECT_EQ(std::ranges::count(summary.left_out, 10), 0);
  EXPECT_EQ(std::ranges::count(summary.left_out, 11), 1);
}

TEST(InputChoice, SameBytesAtAnyNumberOfThreads) {
  const Sample data = friedman(150, 15, 4);
  const std::string one = llmt::to_json(llmt::fit(data.x, data.y, {.max_threads = 1}).model);
  EXPECT_EQ(one, llmt::to_json(llmt::fit(data.x, data.y, {.max_threads = 4}).model));
}

TEST(InputChoice, NamedInputsAndOneLeafKeepAll) {
  const Sample data = friedman(150, 15, 4);
  std::vector<int> named = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  for (const llmt::FitOptions& options :
       {all_inputs(), llmt::FitOptions{.max_leaves = 1}, llmt::FitOptions{.regression_inputs = named},
        llmt::FitOptions{.folds = {.count = 0}}}) {
    const llmt::PartitionSummary summary = llmt::fit(data.x, data.y, options).summary.partitions[0];
    EXPECT_TRUE(summary.left_out.empty());
    EXPECT_TRUE(summary.input_steps.empty());
  }
}

}  // namespace
