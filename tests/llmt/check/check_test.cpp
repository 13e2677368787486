// Whether a model is still good: rates of verdicts, what is named, and the record in its file.
#include "llmt/check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"

namespace {

using llmt::CheckVerdict;
using llmt::TableCheck;

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

struct Rows {
  Eigen::MatrixXd inputs;  // two numbers, and a category of three levels
  Eigen::MatrixXd outputs;
};

// y = 3 x0 below x0 = 0.5 and 5 - x1 above, + a category's offset, + noise. No row lies near the jump, where a held-out
// row on the wrong side would have an error of its own.
Rows drawn(Eigen::Index count, std::uint64_t seed, double noise = 0.1) {
  llmt::Random random(seed);
  Rows rows{Eigen::MatrixXd(count, 3), Eigen::MatrixXd(count, 1)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const double place = random.uniform();
    const double x0 = place < 0.5 ? 0.9 * place : 0.1 + 0.9 * place;
    const double x1 = random.normal();
    const auto kind = static_cast<double>(random.below(3));
    rows.inputs.row(i) << x0, x1, kind;
    rows.outputs(i, 0) = (x0 < 0.5 ? 3.0 * x0 : 5.0 - x1) + 0.5 * kind + noise * random.normal();
  }
  return rows;
}

const llmt::ModelWithIntervals& fitted() {
  static const llmt::ModelWithIntervals file = [] {
    const Rows rows = drawn(600, 1);
    llmt::TrainingData data{rows.inputs, rows.outputs};
    data.input_names = {"x0", "x1", "kind"};
    data.output_names = {"y"};
    data.levels = {{}, {}, {"auto", "eco", "off"}};
    const llmt::FitResult result = llmt::fit(data, {.validity = llmt::ValidityChoice::crisp});
    return llmt::ModelWithIntervals{result.model, result.intervals};
  }();
  return file;
}

TEST(Check, UnchangedRowsAreGood) {
  int good = 0;
  constexpr int draws = 60;
  for (int draw = 0; draw < draws; ++draw) {
    const Rows rows = drawn(150, 100 + static_cast<std::uint64_t>(draw));
    const TableCheck found = llmt::check(fitted(), rows.inputs, rows.outputs);
    EXPECT_NE(found.verdict, CheckVerdict::not_evaluated);
    good += found.verdict == CheckVerdict::good ? 1 : 0;
    if (draw > 0) continue;
    EXPECT_TRUE(found.has_record);
    EXPECT_NEAR(found.targets[0].promised, 0.1, 0.02);
    EXPECT_NEAR(found.targets[0].rmse, 0.1, 0.02);
    EXPECT_NEAR(found.targets[0].covered, 0.9, 0.08);
    EXPECT_NEAR(found.targets[0].limit, 1.1 * found.targets[0].promised, 1e-12);
  }
  EXPECT_GE(good, 53);  // at 95 % fewer come once in 300
}

// The record has a hundred evenly spaced values of the training rows, so that its moments are good to some per cent.
TEST(Check, ShiftsAreInStandardDeviationsOfTheTrainingRows) {
  const Eigen::MatrixXd before = drawn(600, 1).inputs;
  Rows rows = drawn(150, 300);
  rows.inputs.col(1).array() += 4.0;
  const TableCheck found = llmt::check(fitted(), rows.inputs, rows.outputs);
  for (const Eigen::Index j : {0, 1}) {
    const double mean = before.col(j).mean();
    const double deviation = std::sqrt((before.col(j).array() - mean).square().mean());
    EXPECT_NEAR(found.inputs[j].training_mean, mean, 1e-9);
    EXPECT_NEAR(found.inputs[j].mean, rows.inputs.col(j).mean(), 1e-9);
    const double shift = (rows.inputs.col(j).mean() - mean) / deviation;
    EXPECT_NEAR(found.inputs[j].shift, shift, 0.05 * std::abs(shift) + 0.01);
  }
}

TEST(Check, OneRowHasAnError) {
  Rows rows = drawn(40, 301);
  rows.outputs.bottomRows(39).setConstant(nothing);
  const TableCheck found = llmt::check(fitted(), rows.inputs, rows.outputs);
  EXPECT_EQ(found.verdict, CheckVerdict::not_evaluated);
  EXPECT_EQ(found.targets[0].rows, 1);
  const double error = rows.outputs(0, 0) - fitted().model.predict(rows.inputs.topRows(1))(0, 0);
  EXPECT_NEAR(found.targets[0].rmse, std::abs(error), 1e-12);
}

TEST(Check, DoubledNoiseIsNoLongerGood) {
  for (int draw = 0; draw < 10; ++draw) {
    const Rows rows = drawn(150, 200 + static_cast<std::uint64_t>(draw), 0.2);
    const TableCheck found = llmt::check(fitted(), rows.inputs, rows.outputs);
    EXPECT_EQ(found.verdict, CheckVerdict::no_longer_good);
    EXPECT_NEAR(found.targets[0].promised, 0.1, 0.02);  // it does not follow the new errors
    // An error that was stated to be good is, but the change is seen.
    EXPECT_EQ(llmt::check(fitted(), rows.inputs, rows.outputs, {.limits = {0.3}}).verdict,
              CheckVerdict::moved_within_limits);
  }
  const Rows rows = drawn(150, 300);
  EXPECT_EQ(llmt::check(fitted(), rows.inputs, rows.outputs, {.limits = {0.01}}).verdict, CheckVerdict::no_longer_good);
}

TEST(Check, AnInputThatMovedIsNamed) {
  int named = 0;
  for (int draw = 0; draw < 20; ++draw) {
    Rows rows = drawn(600, 400 + static_cast<std::uint64_t>(draw));
    rows.inputs.col(1).array() += 1.0 / 3.0;  // a third of its standard deviation
    rows.outputs.col(0).array() -=
        (rows.inputs.col(0).array() < 0.5).select(0.0, Eigen::ArrayXd::Constant(600, 1.0 / 3.0));
    const TableCheck found = llmt::check(fitted(), rows.inputs, rows.outputs);
    ASSERT_EQ(found.inputs.size(), 3U);
    named += found.inputs[1].has_moved ? 1 : 0;
    EXPECT_NEAR(found.inputs[1].shift, 1.0 / 3.0, 0.25);
    EXPECT_NE(found.verdict, CheckVerdict::no_longer_good);
  }
  EXPECT_GE(named, 18);
}

TEST(Check, ACategoryThatTrainingHadNotCountsAlone) {
  Rows rows = drawn(200, 2);
  rows.inputs(7, 2) = -1.0;
  rows.outputs(7, 0) = fitted().model.predict(rows.inputs.row(7))(0, 0);
  const TableCheck found = llmt::check(fitted(), rows.inputs, rows.outputs);
  EXPECT_EQ(found.verdict, CheckVerdict::moved_within_limits);
  EXPECT_EQ(found.inputs[2].unknown, 1);
  EXPECT_TRUE(found.inputs[2].has_moved);
}

TEST(Check, SharesOfCategoriesEmptyCellsAndRowsOutsideAreTested) {
  Rows rows = drawn(200, 3);
  rows.inputs.col(2).setZero();
  rows.inputs.col(0).head(12).setConstant(nothing);
  rows.inputs.col(1).tail(4).setConstant(-9.0);
  const TableCheck found = llmt::check(fitted(), rows.inputs, rows.outputs);
  EXPECT_LT(found.inputs[2].probability, 1e-6);
  EXPECT_EQ(found.inputs[0].missing, 12);
  EXPECT_LT(found.inputs[0].probability, 1e-3);
  EXPECT_GE(found.inputs[1].below, 4);
  EXPECT_LT(found.inputs[1].probability, 0.01);
  EXPECT_GE(found.outside.size(), 4U);
  EXPECT_EQ(found.outside.back(), 199);
}

TEST(Check, TheLeafThatGotWorseIsFound) {
  Rows rows = drawn(400, 4);
  llmt::Random random(9);
  for (Eigen::Index i = 0; i < 400; ++i) {
    if (rows.inputs(i, 0) > 0.5) rows.outputs(i, 0) += 0.25 * random.normal();
  }
  const TableCheck found = llmt::check(fitted(), rows.inputs, rows.outputs, {.limits = {10.0}});
  EXPECT_EQ(found.verdict, CheckVerdict::moved_within_limits);
  const std::vector<llmt::Leaf> leaves = fitted().model.leaves(0);
  int worse = 0;
  for (const llmt::CheckedLeaf& leaf : found.targets[0].leaves) {
    if (!leaf.is_worse) continue;
    ++worse;
    EXPECT_GT(leaves[leaf.leaf].high(0), 0.52);
    EXPECT_GT(leaf.rmse, 1.5 * leaf.promised);
  }
  EXPECT_GE(worse, 1);
}

TEST(Check, WithoutTargetsOrRowsNothingIsJudged) {
  const Rows rows = drawn(100, 5);
  const Eigen::MatrixXd none = Eigen::MatrixXd::Constant(100, 1, nothing);
  const TableCheck without = llmt::check(fitted(), rows.inputs, none);
  EXPECT_EQ(without.verdict, CheckVerdict::not_evaluated);
  EXPECT_EQ(without.reason, "no row has a value of the target");
  EXPECT_FALSE(std::isnan(without.inputs[0].probability));
  const TableCheck few = llmt::check(fitted(), rows.inputs.topRows(9), rows.outputs.topRows(9));
  EXPECT_EQ(few.verdict, CheckVerdict::not_evaluated);
  EXPECT_EQ(few.reason, "9 rows have a value of the target, 10 are needed");
  EXPECT_NE(llmt::check(fitted(), rows.inputs.topRows(10), rows.outputs.topRows(10)).verdict,
            CheckVerdict::not_evaluated);
  const llmt::ModelWithIntervals bare{fitted().model, {}};
  const TableCheck no_promise = llmt::check(bare, rows.inputs, rows.outputs);
  EXPECT_EQ(no_promise.verdict, CheckVerdict::not_evaluated);
  EXPECT_FALSE(no_promise.has_record);
  EXPECT_EQ(llmt::check(bare, rows.inputs, rows.outputs, {.limits = {0.2}}).verdict, CheckVerdict::good);
}

TEST(Check, RowsWithoutATargetDoNotCount) {
  Rows rows = drawn(200, 6);
  const Rows some = {rows.inputs.topRows(100), rows.outputs.topRows(100)};
  rows.outputs.bottomRows(100).setConstant(nothing);
  const TableCheck found = llmt::check(fitted(), rows.inputs, rows.outputs);
  EXPECT_EQ(found.targets[0].rows, 100);
  EXPECT_DOUBLE_EQ(found.targets[0].rmse, llmt::check(fitted(), some.inputs, some.outputs).targets[0].rmse);
}

TEST(Check, ArgumentsAreChecked) {
  const Rows rows = drawn(20, 7);
  const auto checked = [&](const llmt::CheckOptions& options) {
    return llmt::check(fitted(), rows.inputs, rows.outputs, options);
  };
  EXPECT_THROW(checked({.level = 0.6}), std::invalid_argument);
  EXPECT_THROW(checked({.limits = {1.0, 1.0}}), std::invalid_argument);
  EXPECT_THROW(checked({.limits = {-1.0}}), std::invalid_argument);
  EXPECT_THROW(checked({.weights = Eigen::VectorXd::Zero(20)}), std::invalid_argument);
  EXPECT_THROW(llmt::check(fitted(), rows.inputs, rows.outputs.topRows(3)), std::invalid_argument);
  Eigen::MatrixXd infinite = rows.outputs;
  infinite(3, 0) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(llmt::check(fitted(), rows.inputs, infinite), std::invalid_argument);
}

TEST(Check, NoiseFreeDataAreNotBlamedForRounding) {
  const Rows rows = drawn(300, 8, 0.0);
  const Eigen::MatrixXd y = 2.0 * rows.inputs.col(0) + rows.inputs.col(1);
  const llmt::FitResult result = llmt::fit(rows.inputs, y);
  const Rows fresh = drawn(200, 9, 0.0);
  const Eigen::MatrixXd again = 2.0 * fresh.inputs.col(0) + fresh.inputs.col(1);
  EXPECT_NE(llmt::check({result.model, result.intervals}, fresh.inputs, again).verdict, CheckVerdict::no_longer_good);
}

TEST(Check, TheFileKeepsTheRecord) {
  const llmt::TrainingRecord& record = fitted().intervals.record();
  ASSERT_EQ(record.inputs.size(), 3U);
  EXPECT_EQ(record.inputs[0].rows(), 600);
  EXPECT_EQ(std::ssize(record.inputs[0].values), llmt::most_recorded_values);
  EXPECT_EQ(record.inputs[2].counts.size(), 3U);
  EXPECT_EQ(record.inputs[2].rows(), 600);
  Eigen::Index rows = 0;
  for (const llmt::LeafRecord& leaf : record.leaves[0]) rows += leaf.rows;
  EXPECT_EQ(rows, 600);
  const std::string text = llmt::to_json(fitted().model, fitted().intervals);
  const llmt::ModelWithIntervals again = llmt::from_json_with_intervals(text);
  EXPECT_EQ(again.intervals.record(), record);
  EXPECT_EQ(llmt::to_json(again.model, again.intervals), text);
}

TEST(Check, ARecordStandsForTheSortedRows) {
  Eigen::VectorXd values(1001);
  for (Eigen::Index k = 0; k < 1000; ++k) values(k) = static_cast<double>((k * 7) % 1000);
  values(1000) = nothing;
  const llmt::InputRecord record = llmt::record_of(values, 0);
  EXPECT_EQ(record.missing, 1);
  EXPECT_EQ(record.rows(), 1000);
  ASSERT_EQ(record.values.size(), 100U);
  for (std::size_t k = 0; k < 100; ++k) EXPECT_EQ(record.values[k], 10.0 * static_cast<double>(k) + 5.0);
  const llmt::InputRecord twice = llmt::record_of(Eigen::Vector3d(4.0, 2.0, 4.0), 0, {1, 5, 2});
  EXPECT_EQ(twice.values, (std::vector<double>{2.0, 4.0}));
  EXPECT_EQ(twice.counts, (std::vector<Eigen::Index>{5, 3}));
}

TEST(Check, ARecordThatDoesNotFitIsRefused) {
  const std::vector<llmt::InputColumn> columns = {{.name = "x"}, {.name = "k", .levels = {"a", "b"}}};
  const auto refused = [&](const llmt::TrainingRecord& record) {
    EXPECT_THROW(llmt::check_record(record, columns, 1), std::invalid_argument);
  };
  EXPECT_NO_THROW(llmt::check_record({}, columns, 1));
  EXPECT_NO_THROW(llmt::check_record({{{}, {}}, {}}, columns, 1));
  refused({{{}}, {}});
  refused({{{.missing = -1}, {}}, {}});
  refused({{{.values = {1.0, 1.0}, .counts = {1, 1}}, {}}, {}});
  refused({{{.values = {nothing}, .counts = {1}}, {}}, {}});
  refused({{{.values = {1.0}, .counts = {-1}}, {}}, {}});
  refused({{{.values = {1.0, 2.0}, .counts = {1}}, {}}, {}});
  refused({{{}, {.counts = {1}}}, {}});
  refused({{{}, {.values = {0.0}, .counts = {1, 1}}}, {}});
  refused({{{}, {}}, {{}, {}}});
  refused({{{}, {}}, {{{.rows = 1, .mean_square = -1.0}}}});
}

TEST(Check, ASumOfTreesIsJudgedAlike) {
  const Rows rows = drawn(700, 11);
  llmt::TrainingData data{rows.inputs, rows.outputs};
  data.levels = {{}, {}, {"auto", "eco", "off"}};
  const llmt::BoostedModel model = llmt::fit_boosted(data).model;
  EXPECT_EQ(llmt::boosted_from_json(llmt::to_json(model)).record(), model.record());
  const Rows same = drawn(200, 12);
  EXPECT_EQ(llmt::check(model, same.inputs, same.outputs).verdict, CheckVerdict::good);
  const Rows worse = drawn(200, 13, 0.25);
  const TableCheck found = llmt::check(model, worse.inputs, worse.outputs);
  EXPECT_EQ(found.verdict, CheckVerdict::no_longer_good);
  EXPECT_TRUE(found.targets[0].leaves.empty());
}

}  // namespace
