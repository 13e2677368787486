// The rows of a fit are made ready once.
#include "fit/prepare.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "data/equal_rows.hpp"
#include "data/given_rows.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "llmt/readable.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"

namespace {

// Two outputs of a month 1 ... 6 without order and two numbers; one in a hundred outputs is wrong.
llmt::TrainingData months(Eigen::Index rows, Eigen::Index outputs) {
  const std::vector<double> of_month = {0.0, 1.5, -1.2, 0.8, 2.0, -0.5};
  llmt::Random random(4);
  llmt::TrainingData data{Eigen::MatrixXd(rows, 3), Eigen::MatrixXd(rows, outputs)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const int month = static_cast<int>(random.uniform(0.0, 6.0));
    data.inputs.row(i) << month + 1, random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0);
    for (Eigen::Index o = 0; o < outputs; ++o) {
      data.outputs(i, o) = of_month[month] * (1.0 + static_cast<double>(o) * data.inputs(i, 1)) +
                           std::abs(data.inputs(i, 1)) * data.inputs(i, 2) + 0.1 * random.normal() +
                           (i % 100 == 7 ? 30.0 : 0.0);
    }
  }
  return data;
}

// How often all rows are hashed and sorted for a fit and a readable tree beside it.
long times_numbered(const llmt::TrainingData& data, const llmt::FitOptions& options) {
  const long before = llmt::times_rows_were_numbered();
  const llmt::PreparedFit prepared(data, options);
  const llmt::FitResult fitted = llmt::fit(prepared);
  llmt::fit_readable(prepared, fitted.summary);
  EXPECT_EQ(fitted.summary.held_out.size(), 5U);
  return llmt::times_rows_were_numbered() - before;
}

TEST(Prepare, AFitAndAReadableTreeNumberTheRowsOnce) {
  for (const Eigen::Index outputs : {1, 2}) {
    for (const llmt::Loss loss : {llmt::Loss::squared, llmt::Loss::tukey}) {
      for (const llmt::LocalTerms terms : {llmt::LocalTerms::linear, llmt::LocalTerms::automatic}) {
        llmt::TrainingData data = months(300, outputs);
        const llmt::FitOptions options{.max_leaves = 4, .terms = terms, .loss = loss};
        EXPECT_EQ(times_numbered(data, options), 1) << outputs << name_of(loss) << name_of(terms);
        data.inputs(5, 1) = oracle::missing;
        data.inputs.row(8) = data.inputs.row(9);
        data.outputs.row(8) = data.outputs.row(9);
        EXPECT_EQ(times_numbered(data, options), 1) << outputs << name_of(loss) << name_of(terms);
      }
    }
  }
}

TEST(Prepare, AFitOfPreparedDataIsTheFitOfTheData) {
  const llmt::TrainingData data = months(300, 2);
  for (const llmt::Loss loss : {llmt::Loss::squared, llmt::Loss::tukey}) {
    const llmt::FitOptions options{.max_leaves = 4, .loss = loss};
    const llmt::PreparedFit prepared(data, options);
    const llmt::FitResult fitted = llmt::fit(llmt::PreparedFit(prepared));
    EXPECT_EQ(to_json(fitted.model), to_json(llmt::fit(data.inputs, data.outputs, options).model));
    EXPECT_EQ(fitted.summary.codes.taken, std::vector<int>{0});
  }
}

TEST(Prepare, ResultsHaveTheNamesOfTheData) {
  llmt::TrainingData data = months(200, 1);
  data.inputs.col(0).array() -= 1.0;
  data.categorical_inputs = {0};
  const llmt::FitOptions options{.max_leaves = 3};
  const llmt::Model plain = llmt::fit(data, options).model;
  data.categorical_inputs = {};
  data.levels = {{"Jan", "Feb", "Mar", "Apr", "May", "Jun"}, {}, {}};
  data.input_names = {"month", "a", "b"};
  data.output_names = {"load"};
  const std::string expected = to_json(plain.named(data.input_names, data.output_names, data.levels));
  EXPECT_EQ(to_json(llmt::fit(data, options).model), expected);
  const llmt::PreparedFit prepared(data, options);
  const llmt::FitResult fitted = llmt::fit(prepared);
  EXPECT_EQ(to_json(fitted.model), expected);
  EXPECT_EQ(llmt::fit_readable(prepared, fitted.summary).model.inputs()[0].levels, data.levels[0]);
}

// Rows that a fold holds out are dealt anew when the loss leaves rows out; which rows are equal is known before.
TEST(Prepare, FewerRowsAreNumberedAsTheyWouldBeAlone) {
  llmt::TrainingData data = months(60, 1);
  data.inputs = data.inputs.replicate(3, 1).eval();
  data.outputs = data.outputs.replicate(3, 1).eval();
  const llmt::FitOptions options;
  const llmt::GivenRows given = llmt::checked(llmt::given_rows(data), options);
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < 180; row += 1 + row % 4) rows.push_back(row);
  const llmt::GivenRows some = llmt::rows_at(given, rows);
  const llmt::GivenRows alone = llmt::checked({.inputs = some.inputs, .outputs = some.outputs}, options);
  EXPECT_EQ(some.numbers->by_inputs, alone.numbers->by_inputs);
  EXPECT_EQ(some.numbers->by_all, alone.numbers->by_all);
  const llmt::KeptRows kept = llmt::keep(some, options.folds);
  EXPECT_EQ(kept.copies, llmt::keep(alone, options.folds).copies);
  EXPECT_LT(kept.count(), std::ssize(rows));
}

// Tables are shared by copies, and stay where they are when a training is moved.
TEST(Prepare, ATrainingMayBeMoved) {
  const llmt::TrainingData data = months(40, 1);
  llmt::Work uncounted;
  const llmt::GivenRows given = llmt::checked(llmt::given_rows(data), {});
  const llmt::PreparedRows rows = llmt::prepare_plain(given, {}, uncounted);
  std::vector<llmt::Training> moved;
  moved.push_back(llmt::narrowed(*rows.training, {0, 1}, std::vector<std::vector<int>>(5, {0, 1})));
  const llmt::Training last = std::move(moved.front());
  EXPECT_EQ(last.all.table, last.weighted.get());
  EXPECT_EQ(last.folds[0].training.table, rows.training->weighted.get());
  EXPECT_EQ(last.folds[0].held_out.table, rows.training->table.get());
  EXPECT_EQ(std::ssize(last.all.regressors), 2);
}

}  // namespace
