// Rows that the caller holds out: they decide on the model, and take no part in it.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "llmt/compare.hpp"
#include "llmt/fit.hpp"
#include "llmt/fit/fit_cases.hpp"
#include "llmt/random.hpp"
#include "llmt/readable.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"
#include "oracles/thrown.hpp"

namespace given_hold_out {
namespace {

using Folds = std::vector<std::vector<Eigen::Index>>;

// Curved, with noise; every fourth row is held out.
llmt::TrainingData table(Eigen::Index rows, std::uint64_t seed) {
  llmt::TrainingData data{.inputs = oracle::uniform(rows, 3, seed)};
  data.outputs = oracle::curved(data.inputs, 0.1, seed);
  for (Eigen::Index i = 1; i < rows; i += 4) data.held_out.push_back(i);
  return data;
}

std::vector<Eigen::Index> learned_rows(const llmt::TrainingData& data) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < data.inputs.rows(); ++i) {
    if (std::ranges::find(data.held_out, i) == data.held_out.end()) rows.push_back(i);
  }
  return rows;
}

llmt::TrainingData with_gaps_and_words(llmt::TrainingData data) {
  llmt::Random random(5);
  data.inputs.conservativeResize(Eigen::NoChange, 5);
  for (Eigen::Index i = 0; i < data.inputs.rows(); ++i) {
    data.inputs(i, 3) = static_cast<double>(random.below(4));
    data.inputs(i, 4) = random.below(10) == 0 ? oracle::missing : random.normal();
    data.outputs(i, 0) += 0.3 * data.inputs(i, 3) + (std::isnan(data.inputs(i, 4)) ? 0.1 : 0.2 * data.inputs(i, 4));
  }
  data.categorical_inputs = {3};
  return data;
}

TEST(GivenHoldOut, ChangesTheChoiceButNoCoefficient) {
  const llmt::TrainingData data = with_gaps_and_words(table(600, 1));
  llmt::TrainingData other = data;
  for (const Eigen::Index row : data.held_out) other.outputs(row, 0) *= 1.0 + 1e-9;
  for (const fit_cases::Case& each : fit_cases::usual()) {
    SCOPED_TRACE(each.name);
    const llmt::FitResult first = llmt::fit(data, each.options);
    const llmt::FitResult second = llmt::fit(other, each.options);
    EXPECT_TRUE(to_json(first.model) == to_json(second.model));
    EXPECT_NE(first.summary.partitions[0].chosen.rmse, second.summary.partitions[0].chosen.rmse);
    EXPECT_EQ(first.summary.samples, 450);
  }
  // Extents are of the other rows.
  other.inputs(1, 0) = 1.5;
  EXPECT_LT(llmt::fit(other).model.inputs()[0].high, 1.0);
  // Held-out rows without structure leave fewer leaves.
  for (const Eigen::Index row : data.held_out) other.outputs(row, 0) = row % 8 == 1 ? 10.0 : -10.0;
  const llmt::FitOptions crisp{.validity = llmt::ValidityChoice::crisp};
  EXPECT_GT(llmt::fit(data, crisp).summary.partitions[0].leaves, 3);
  EXPECT_LT(llmt::fit(other, crisp).summary.partitions[0].leaves, llmt::fit(data, crisp).summary.partitions[0].leaves);
}

// The same rows without those that are held out, and nothing left to choose. (A blend is carried on beyond its rows by
// slopes of the larger tree that was grown, so crisp leaves alone can be made again like this.)
TEST(GivenHoldOut, TheModelIsThatOfTheOtherRowsAlone) {
  const llmt::TrainingData data = table(800, 2);
  const std::vector<Eigen::Index> rows = learned_rows(data);
  llmt::FitOptions options{.choose_inputs = false, .validity = llmt::ValidityChoice::crisp};
  const llmt::FitResult found = llmt::fit(data, options);
  const llmt::Candidate& chosen = found.summary.partitions[0].chosen.candidate;
  ASSERT_GT(chosen.leaves, 3);
  options.max_leaves = chosen.leaves;
  options.min_leaf_samples = found.summary.min_leaf_samples;
  options.expert.shrinkages = {chosen.shrinkage};
  options.folds.count = 0;
  const llmt::FitResult alone = llmt::fit(data.inputs(rows, Eigen::all), data.outputs(rows, Eigen::all), options);
  EXPECT_TRUE(to_json(found.model) == to_json(alone.model));
}

// A fit of many rows holds out one fold. Given the rows of that fold it chooses the same, and its model is that of the
// fold.
TEST(GivenHoldOut, IsTheFoldOfAFitOfManyRows) {
  llmt::TrainingData data = table(50000, 3);
  data.held_out.clear();
  const llmt::FitOptions options{.max_leaves = 5};
  const llmt::FitResult dealt = llmt::fit(data, options);
  data.held_out = dealt.summary.held_out.front();
  ASSERT_EQ(data.held_out.size(), 10000U);
  const llmt::FitResult given = llmt::fit(data, options);
  EXPECT_EQ(given.summary.held_out, dealt.summary.held_out);
  EXPECT_EQ(given.summary.partitions[0].chosen.candidate, dealt.summary.partitions[0].chosen.candidate);
  EXPECT_EQ(given.summary.partitions[0].chosen.rmse, dealt.summary.partitions[0].chosen.rmse);
  EXPECT_TRUE(to_json(given.intervals.models()[0]) == to_json(dealt.intervals.models()[0]));
  ASSERT_EQ(given.intervals.parts().size(), 5U);
  for (std::size_t p = 0; p < 5; ++p) {
    EXPECT_EQ(given.intervals.parts()[p].residuals, dealt.intervals.parts()[p].residuals);
    EXPECT_EQ(given.intervals.parts()[p].spreads, dealt.intervals.parts()[p].spreads);
  }
  const Eigen::MatrixXd asked = data.inputs.topRows(1000);
  EXPECT_EQ(given.model.predict(asked), given.intervals.models()[0].predict(asked));
}

TEST(GivenHoldOut, IntervalsAreOfItsResiduals) {
  const llmt::TrainingData data = table(600, 4);
  const llmt::FitResult result = llmt::fit(data);
  EXPECT_EQ(result.summary.held_out, Folds{data.held_out});
  EXPECT_EQ(result.summary.partitions[0].held_out_rows, 150);
  const Eigen::MatrixXd outputs = data.outputs(data.held_out, Eigen::all);
  const Eigen::MatrixXd predicted = result.model.predict(data.inputs(data.held_out, Eigen::all));
  const Eigen::MatrixXd x = data.inputs(data.held_out, Eigen::all);
  // Each residual is that of one row, by the spread there.
  std::vector<bool> is_found(150, false);
  for (const llmt::HeldOutPart& part : result.intervals.parts()) {
    EXPECT_EQ(part.model, 0U);
    for (const double residual : part.residuals.reshaped()) {
      for (Eigen::Index row = 0; row < 150; ++row) {
        const double spread = part.spreads.empty() ? 1.0 : llmt::spread_at(part.spreads[0], x, row, predicted(row, 0));
        if (residual == std::abs(outputs(row, 0) - predicted(row, 0)) / spread) is_found[row] = true;
      }
    }
  }
  EXPECT_EQ(std::ranges::count(is_found, true), 150);
  EXPECT_NEAR(result.summary.partitions[0].chosen.rmse, llmt::rmse(predicted, outputs)(0), 1e-12);
}

TEST(GivenHoldOut, SameBytesAtAnyNumberOfThreads) {
  llmt::TrainingData data = with_gaps_and_words(table(600, 6));
  data.outputs.conservativeResize(Eigen::NoChange, 2);
  data.outputs.col(1) = oracle::curved(data.inputs.leftCols(3), 0.2, 7);
  std::vector<std::string> models;
  for (const int threads : {1, 2, 8}) {
    const llmt::PreparedFit prepared(data, {.max_threads = threads});
    const llmt::FitResult result = llmt::fit(prepared);
    models.push_back(to_json(result.model, result.intervals));
    models.back() += to_json(llmt::fit_readable(prepared, result.summary).model);
  }
  EXPECT_TRUE(models[0] == models[1]);
  EXPECT_TRUE(models[0] == models[2]);
}

// Copies of rows on one side are no copies of the other's. Groups deal nothing.
TEST(GivenHoldOut, HoldsOutCopiesAsTheyAreGiven) {
  llmt::TrainingData data = table(400, 8);
  data.inputs = data.inputs.replicate(2, 1).eval();
  data.outputs = data.outputs.replicate(2, 1).eval();
  data.held_out.clear();
  for (Eigen::Index i = 500; i < 800; ++i) data.held_out.push_back(i);
  const llmt::FitResult result = llmt::fit(data);
  EXPECT_EQ(result.summary.held_out, Folds{data.held_out});
  EXPECT_EQ(result.summary.samples, 500);
  data.groups.assign(800, 1.0);
  EXPECT_EQ(llmt::fit(data).summary.held_out, Folds{data.held_out});
}

TEST(GivenHoldOut, InputsAndCodesAreChosenOnIt) {
  llmt::TrainingData data = table(800, 9);
  llmt::Random random(10);
  const std::vector<double> of_code = {0.0, 3.0, -2.0, 1.0, -3.0};
  data.inputs.conservativeResize(Eigen::NoChange, 8);
  for (double& value : data.inputs.rightCols(5).reshaped()) value = random.normal();
  for (Eigen::Index i = 0; i < 800; ++i) {
    data.inputs(i, 3) = static_cast<double>(random.below(5));
    data.outputs(i, 0) += of_code[static_cast<std::size_t>(data.inputs(i, 3))];
  }
  const llmt::FitSummary summary = llmt::fit(data).summary;
  EXPECT_EQ(summary.codes.taken, std::vector<int>{3});
  const std::vector<int>& left_out = summary.partitions[0].left_out;
  EXPECT_FALSE(left_out.empty());
  for (const int input : left_out) EXPECT_GT(input, 3);
}

TEST(GivenHoldOut, RefusesRowsThatLeaveNoChoice) {
  const llmt::TrainingData good = table(60, 11);
  const auto refused = [&](const auto& change, const llmt::FitOptions& options = {}) {
    llmt::TrainingData data = good;
    change(data);
    return oracle::thrown<std::invalid_argument>([&] { llmt::fit(data, options); });
  };
  EXPECT_EQ(refused([](auto& data) {
              data.held_out = {3, 60};
            }),
            "llmt::fit: held_out[1] is 60, it must be a row from 0 to 59");
  EXPECT_EQ(refused([](auto& data) { data.held_out = {-1}; }),
            "llmt::fit: held_out[0] is -1, it must be a row from 0 to 59");
  EXPECT_EQ(refused([](auto& data) { data.held_out = {7, 3, 7}; }), "llmt::fit: held_out has row 7 twice");
  const auto hold_out_all = [](auto& data) {
    data.held_out.clear();
    for (Eigen::Index i = 0; i < 60; ++i) data.held_out.push_back(i);
  };
  EXPECT_EQ(refused(hold_out_all), "llmt::fit: held_out has all rows, none is left to learn from");
  EXPECT_EQ(refused([](auto& data) {
              data.weights = Eigen::VectorXd::Ones(60);
              data.weights(data.held_out).setZero();
            }),
            "llmt::fit: held_out has no row of positive weight");
  EXPECT_EQ(refused([](auto& data) {
              data.weights = Eigen::VectorXd::Zero(60);
              data.weights(data.held_out).setOnes();
            }),
            "llmt::fit: held_out has all rows of positive weight, none is left to learn from");
  llmt::FitOptions no_folds;
  no_folds.folds.count = 0;
  EXPECT_EQ(refused([](auto&) {}, no_folds),
            "llmt::fit: held_out has rows to choose on, but folds.count is 0: nothing is chosen");
  EXPECT_EQ(oracle::thrown<std::invalid_argument>([&] { llmt::compare(good, llmt::usual_methods({}, good)); }),
            "llmt::compare: held_out is for fit(); methods are compared on CompareOptions::folds");
}

}  // namespace
}  // namespace given_hold_out
