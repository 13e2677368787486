// What a check says of one input and of one target, from records and errors that are written down.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "check/check_inputs.hpp"
#include "check/check_targets.hpp"
#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "numerics/f_distribution.hpp"
#include "numerics/two_samples.hpp"

namespace {

using llmt::CheckVerdict;

constexpr double absent = std::numeric_limits<double>::quiet_NaN();

// The values 0.5, 1.5, ..., 99.5 of training, each once.
llmt::InputRecord hundred_values() {
  llmt::InputRecord record;
  for (int k = 0; k < 100; ++k) record.values.push_back(0.5 + k);
  record.counts.assign(100, 1);
  return record;
}

llmt::CheckedInput checked_number(const Eigen::VectorXd& values, const llmt::InputRecord& record) {
  const llmt::InputColumn column{.name = "x", .low = 0.5, .high = 99.5, .centre = 50.0};
  return llmt::check_inputs({column}, {true}, values, values, {{record}, {}})[0];
}

TEST(CheckedInputs, TheSmallestOfThreeProbabilitiesCountsThreeTimes) {
  const llmt::InputRecord record = hundred_values();
  Eigen::VectorXd values = Eigen::VectorXd::LinSpaced(20, 4.0, 96.0);
  values.tail(2) << 101.0, 102.0;
  const llmt::CheckedInput found = checked_number(values, record);
  EXPECT_EQ(found.below, 0);
  EXPECT_EQ(found.above, 2);
  // Two of 20 above the largest of 100: the two largest of all 120 are among the 20.
  const double beyond = 20.0 / 120.0 * 19.0 / 119.0;
  const std::vector<double> present(values.begin(), values.end());
  EXPECT_LT(beyond, llmt::same_numbers_probability({record.values, record.counts}, present));
  EXPECT_NEAR(found.probability, 3.0 * beyond, 1e-12);
}

TEST(CheckedInputs, AProbabilityIsAtMostOne) {
  EXPECT_EQ(checked_number(Eigen::VectorXd::LinSpaced(50, 1.0, 99.0), hundred_values()).probability, 1.0);
}

// Values 1 and 3, twice as many of the latter: mean 7 / 3, variance 8 / 9.
TEST(CheckedInputs, TheShiftIsCountedByTheRowsOfTheRecord) {
  const llmt::InputRecord record{.values = {1.0, 3.0}, .counts = {10, 20}};
  const llmt::InputColumn column{.name = "x", .low = 1.0, .high = 3.0, .centre = 7.0 / 3.0};
  const Eigen::VectorXd values = Eigen::VectorXd::Constant(5, 3.0);
  const llmt::CheckedInput found = llmt::check_inputs({column}, {true}, values, values, {{record}, {}})[0];
  EXPECT_NEAR(found.shift, (2.0 / 3.0) / std::sqrt(8.0 / 9.0), 1e-12);
}

TEST(CheckedInputs, EmptyCellsAreMissingAndOnlyWhatTrainingHadNotIsUnknown) {
  const auto checked = [](const llmt::InputColumn& column, const Eigen::VectorXd& given, const Eigen::VectorXd& at) {
    return llmt::check_inputs({column}, {true}, given, at, {})[0];
  };
  const llmt::InputColumn column{.name = "k", .levels = {"a", "b"}};
  const Eigen::VectorXd positions = (Eigen::VectorXd(7) << 0.0, 1.0, absent, absent, 0.5, 2.0, -1.0).finished();
  const llmt::CheckedInput named = checked(column, positions, positions);
  EXPECT_EQ(named.missing, 2);
  EXPECT_EQ(named.unknown, 3);
  llmt::InputColumn coded = column;
  coded.codes = {10.0, 20.0};
  const Eigen::VectorXd given = (Eigen::VectorXd(4) << 10.0, 20.0, absent, 15.0).finished();
  const Eigen::VectorXd at = (Eigen::VectorXd(4) << 0.0, 1.0, absent, 0.0).finished();
  const llmt::CheckedInput numbers = checked(coded, given, at);
  EXPECT_EQ(numbers.missing, 1);
  EXPECT_EQ(numbers.unknown, 1);
}

// Held-out errors of 1 and 3 in turn, and new ones of `error` with spreads of 2.
llmt::JudgedTarget judged(const llmt::OutputColumn& column, Eigen::Index rows, double error) {
  llmt::JudgedTarget target{.column = column,
                            .observed = Eigen::VectorXd::Constant(rows, 7.0 + error),
                            .predicted = Eigen::VectorXd::Constant(rows, 7.0),
                            .spreads = Eigen::VectorXd::Constant(rows, 2.0),
                            .held_out = {}};
  for (int k = 0; k < 40; ++k) target.held_out.push_back(k % 2 == 0 ? 1.0 : 3.0);
  return target;
}

TEST(CheckedTargets, RowsOnEitherSideOfTheirIntervalsAreNotCovered) {
  const llmt::OutputColumn column{.name = "y"};
  llmt::JudgedTarget target = judged(column, 4, 0.0);
  target.lower = Eigen::VectorXd::Constant(4, 6.0);
  target.upper = Eigen::VectorXd::Constant(4, 8.0);
  EXPECT_EQ(llmt::check_target(target).covered, 1.0);
  target.observed(0) = 5.0;
  EXPECT_EQ(llmt::check_target(target).covered, 0.75);
  target.observed(3) = 9.0;
  EXPECT_EQ(llmt::check_target(target).covered, 0.5);
  target.observed.tail(3).setConstant(absent);
  EXPECT_EQ(llmt::check_target(target).covered, 0.0);
  llmt::JudgedTarget alone = judged(column, 1, 3.0);
  alone.lower = Eigen::VectorXd::Constant(1, 6.0);
  alone.upper = Eigen::VectorXd::Constant(1, 8.0);
  EXPECT_EQ(llmt::check_target(alone).covered, 0.0);
}

// The squares 1 and 9 have the mean 5 and the mean square 41: kurtosis 41 / 25, and 2 / (41 / 25 - 1) degrees of
// freedom a row (Box 1953).
TEST(CheckedTargets, ALeafIsTestedByTheFreedomThatTheKurtosisLeaves) {
  const llmt::OutputColumn column{.name = "y"};
  llmt::JudgedTarget target = judged(column, 12, 5.0);
  target.leaf_of = Eigen::VectorXi::Zero(12);
  target.leaves = {{.rows = 30, .mean_square = 4.0}};
  const llmt::CheckedTarget found = llmt::check_target(target);
  EXPECT_NEAR(found.promised, 2.0 * std::sqrt(5.0), 1e-12);
  ASSERT_EQ(found.leaves.size(), 1U);
  const llmt::CheckedLeaf& leaf = found.leaves[0];
  EXPECT_NEAR(leaf.rmse, 5.0, 1e-12);
  EXPECT_NEAR(leaf.promised, 2.0 * 2.0, 1e-12);
  const double freedom = 2.0 / (41.0 / 25.0 - 1.0);
  EXPECT_NEAR(leaf.probability, llmt::f_survival(2.5 * 2.5 / 4.0, 12.0 * freedom, 30.0 * freedom), 1e-12);
}

struct LineData {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
};

LineData line_data(Eigen::Index rows, std::uint64_t seed, double noise) {
  llmt::Random random(seed);
  LineData data{Eigen::MatrixXd(rows, 1), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    data.inputs(i, 0) = random.uniform();
    data.outputs(i, 0) = data.inputs(i, 0) + noise * random.normal();
  }
  return data;
}

// Two parts without trees, of which one promises rows of the weight 4 half the error: r = 1, w0 = 1. In the gap from
// 0.4 to 0.6 errors are as much larger as the 99th percentile of those held out is than the 90th.
TEST(CheckedTargets, TheErrorThatIsPromisedIsOfTheSpreadsOfTheNewRows) {
  const LineData data = line_data(200, 1, 0.1);
  const llmt::Model model = llmt::fit(data.inputs, data.outputs).model;
  Eigen::VectorXd residuals = Eigen::VectorXd::Constant(100, 0.1);
  residuals.tail(4).setConstant(0.3);
  const llmt::Spread by_weight{.noise_share = 1.0, .usual_weight = 1.0};
  const std::vector<llmt::HeldOutPart> parts = {
      {.model = 0, .residuals = residuals, .incomplete = Eigen::MatrixXd(0, 1), .spreads = {by_weight}},
      {.model = 0, .residuals = residuals, .incomplete = Eigen::MatrixXd(0, 1)}};
  const llmt::Intervals intervals({model}, parts, {{{{0, 0.4, 0.6}}}});
  const double held_out = std::sqrt(0.96 * 0.01 + 0.04 * 0.09);
  const auto promised = [&](double x, double weight) {
    const Eigen::MatrixXd inputs = Eigen::MatrixXd::Constant(20, 1, x);
    llmt::CheckOptions options;
    if (weight > 0.0) options.weights = Eigen::VectorXd::Constant(20, weight);
    return llmt::check({model, intervals}, inputs, inputs, options).targets[0].promised;
  };
  EXPECT_NEAR(promised(0.2, 0.0), held_out, 1e-12);
  EXPECT_NEAR(promised(0.2, 4.0), 0.75 * held_out, 1e-12);
  EXPECT_NEAR(promised(0.5, 0.0), 3.0 * held_out, 1e-12);
}

// Of 1000 rows so many lie in their intervals, where the model is exact, and the others right above.
TEST(CheckedTargets, IntervalsAreNoLongerGoodBelow85PerCent) {
  const LineData data = line_data(600, 2, 0.1);
  const llmt::FitResult fitted = llmt::fit(data.inputs, data.outputs);
  const Eigen::MatrixXd inputs = line_data(1000, 3, 0.1).inputs;
  const auto verdict = [&](Eigen::Index inside) {
    Eigen::MatrixXd outputs = fitted.model.predict(inputs);
    const llmt::Bounds bounds = fitted.intervals.predict(inputs, 0.9);
    outputs.bottomRows(1000 - inside) = bounds.upper.bottomRows(1000 - inside).array() + 1e-6;
    const llmt::TableCheck found = llmt::check({fitted.model, fitted.intervals}, inputs, outputs);
    EXPECT_NEAR(found.targets[0].covered, static_cast<double>(inside) / 1000.0, 1e-12);
    EXPECT_TRUE(found.targets[0].is_worse);
    return found.verdict;
  };
  EXPECT_EQ(verdict(845), CheckVerdict::no_longer_good);
  EXPECT_EQ(verdict(852), CheckVerdict::moved_within_limits);
}

// A sum of trees has no leaves that could be worse in its place.
TEST(CheckedTargets, ALargerErrorWithinItsLimitIsAChange) {
  const LineData data = line_data(300, 4, 0.1);
  const llmt::BoostedModel model = llmt::fit_boosted({data.inputs, data.outputs}).model;
  const LineData worse = line_data(200, 5, 0.3);
  EXPECT_EQ(llmt::check(model, worse.inputs, worse.outputs, {.limits = {1.0}}).verdict,
            CheckVerdict::moved_within_limits);
}

// Five held-out rows are too few for 90 % intervals.
TEST(CheckedTargets, OfFewHeldOutRowsTheSumPromisesNothing) {
  const LineData data = line_data(300, 6, 0.1);
  const llmt::BoostedModel model = llmt::fit_boosted({data.inputs, data.outputs}).model;
  std::vector<llmt::BoostedSum> sums = model.sums();
  sums[0].held_out.resize(1);
  sums[0].held_out[0].residuals.resize(5);
  const llmt::BoostedModel few(model.inputs(), model.outputs(), model.deviations(), sums);
  const llmt::TableCheck found = llmt::check(few, data.inputs, data.outputs);
  EXPECT_EQ(found.verdict, CheckVerdict::not_evaluated);
  EXPECT_EQ(found.reason,
            "the model's file has the errors of fewer than 10 held-out rows, so that it promises nothing");
  EXPECT_TRUE(std::isnan(found.targets[0].covered));
}

}  // namespace
