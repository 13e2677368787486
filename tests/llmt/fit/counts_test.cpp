// A row of weight k is the row k times, and a row of weight 0 no row, to the last byte.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/fit/fit_cases.hpp"
#include "llmt/random.hpp"
#include "llmt/readable.hpp"
#include "oracles/samples.hpp"
#include "study.hpp"

namespace counts_of_rows {
namespace {

using Counts = std::vector<int>;

// Three numbers, a category, and a number with empty cells: the first of the two outputs is curved and has a step, the
// second is affine.
llmt::TrainingData table(Eigen::Index rows, std::uint64_t seed) {
  llmt::Random random(seed);
  llmt::TrainingData data{Eigen::MatrixXd(rows, 5), Eigen::MatrixXd(rows, 2)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const double b = random.uniform(-1.0, 1.0);
    const double c = random.uniform(-1.0, 1.0);
    const double d = random.uniform(0.0, 5.0);
    const auto level = static_cast<double>(random.below(4));
    data.inputs.row(i) << a, b, c, level, random.below(20) == 0 ? oracle::missing : d;
    const double step = level > 1.0 ? 1.0 : 0.0;
    data.outputs.row(i) << std::sin(3.0 * a) + b * b + (c > 0.2 ? 1.0 : 0.0) + step * a + 0.2 * d, a - b + step;
    data.outputs(i, 0) += 0.2 * random.normal();
    data.outputs(i, 1) += 0.1 * random.normal();
  }
  data.categorical_inputs = {3};
  return data;
}

llmt::TrainingData of_one_output(llmt::TrainingData data) {
  data.outputs = data.outputs.leftCols(1).eval();
  return data;
}

// The same with inputs of few values, in which rows meet by chance.
llmt::TrainingData of_few_values(llmt::TrainingData data) {
  data.inputs.leftCols(3) = (2.0 * data.inputs.leftCols(3)).array().round();
  data.inputs.col(4) = data.inputs.col(4).array().round();
  return data;
}

Counts random_counts(Eigen::Index rows, std::uint64_t seed) {
  llmt::Random random(seed);
  Counts counts;
  for (Eigen::Index i = 0; i < rows; ++i) counts.push_back(static_cast<int>(random.below(4)));
  return counts;
}

// Most rows count once, a few twice, a few not at all.
Counts mostly_one(Eigen::Index rows) {
  Counts counts(rows, 1);
  for (Eigen::Index i = 0; i < rows; i += 40) counts[i] = 2;
  for (Eigen::Index i = 3; i < rows; i += 50) counts[i] = 0;
  return counts;
}

// The table with the counts as weights. Rows that do not count are far from all others.
llmt::TrainingData weighted(llmt::TrainingData data, const Counts& counts) {
  data.weights.resize(std::ssize(counts));
  for (Eigen::Index i = 0; i < data.weights.size(); ++i) {
    data.weights(i) = counts[i];
    if (counts[i] > 0) continue;
    data.inputs.row(i) << 50.0, -50.0, oracle::missing, 7.0, 1e3;
    data.outputs.row(i).setConstant(1e4);
  }
  return data;
}

// The table in which a row stands as often as it counts.
llmt::TrainingData repeated(llmt::TrainingData data, const Counts& counts) {
  std::vector<Eigen::Index> rows;
  std::vector<double> groups;
  std::vector<Eigen::Index> held_out;
  for (Eigen::Index i = 0; i < std::ssize(counts); ++i) {
    for (int k = 0; k < counts[i]; ++k) {
      if (!data.groups.empty()) groups.push_back(data.groups[i]);
      if (std::ranges::find(data.held_out, i) != data.held_out.end()) held_out.push_back(std::ssize(rows));
      rows.push_back(i);
    }
  }
  data.inputs = data.inputs(rows, Eigen::all).eval();
  data.outputs = data.outputs(rows, Eigen::all).eval();
  data.groups = groups;
  data.held_out = held_out;
  return data;
}

// Texts are long: they are not printed.
void expect_same(const llmt::FitResult& found, const llmt::FitResult& expected) {
  EXPECT_TRUE(to_json(found.model, found.intervals) == to_json(expected.model, expected.intervals));
  EXPECT_EQ(found.summary.codes.taken, expected.summary.codes.taken);
  for (std::size_t p = 0; p < expected.summary.partitions.size(); ++p) {
    const llmt::PartitionSummary& of_found = found.summary.partitions[p];
    const llmt::PartitionSummary& of_expected = expected.summary.partitions[p];
    EXPECT_EQ(of_found.left_out, of_expected.left_out);
    ASSERT_EQ(of_found.crisp_cv_rmse.size(), of_expected.crisp_cv_rmse.size());
    EXPECT_EQ(of_found.crisp_cv_rmse, of_expected.crisp_cv_rmse);
    EXPECT_EQ(of_found.chosen.fold_rmse, of_expected.chosen.fold_rmse);
  }
}

void expect_same_bytes(const llmt::TrainingData& data, const Counts& counts, const llmt::FitOptions& options) {
  expect_same(llmt::fit(weighted(data, counts), options), llmt::fit(repeated(data, counts), options));
}

using fit_cases::Case;

std::vector<Case> cases() {
  std::vector<Case> cases = fit_cases::usual();
  const auto add = [&](const char* name, const auto& change) { fit_cases::add(cases, name, change); };
  add("gaussian", [](llmt::FitOptions& options) { options.validity = llmt::ValidityChoice::gaussian; });
  add("weakest link", [](llmt::FitOptions& options) { options.pruning = llmt::Pruning::weakest_link; });
  add("shared", [](llmt::FitOptions& options) { options.shared_partition = true; });
  add("blocks", [](llmt::FitOptions& options) { options.folds.kind = llmt::FoldKind::contiguous; });
  add("monotone", [](llmt::FitOptions& options) {
    options.max_leaves = 4;
    options.trends = {llmt::Trend::rising, llmt::Trend::any, llmt::Trend::any, llmt::Trend::any, llmt::Trend::any};
  });
  add("no folds", [](llmt::FitOptions& options) { options.folds.count = 0; });
  add("no folds, aicc", [](llmt::FitOptions& options) {
    options = {.rule = llmt::GrowthRule::lolimot};
    options.folds.count = 0;
  });
  return cases;
}

constexpr Eigen::Index rows = 600;

TEST(Counts, AreRepeatedRowsForEveryOption) {
  constexpr Eigen::Index few = 200;  // there are many options
  const llmt::TrainingData data = table(few, 1);
  const llmt::TrainingData one = of_one_output(data);
  std::size_t turn = 0;
  for (const Case& each : cases()) {
    SCOPED_TRACE(each.name);
    const llmt::TrainingData& of_case = each.options.shared_partition ? data : one;
    const std::vector<Counts> both = {random_counts(few, 2), mostly_one(few)};
    // The gate takes them in turns.
    for (std::size_t k = sampled<std::size_t>(0, turn++ % 2); k < 2; k += sampled(1, 2))
      expect_same_bytes(of_case, both[k], each.options);
  }
  Counts of_all_rows = random_counts(few, 3);
  for (int& count : of_all_rows) ++count;
  expect_same_bytes(data, of_all_rows, {.max_leaves = 6});
}

TEST(Counts, AreRepeatedRowsInTablesOfFewValues) {
  const llmt::TrainingData data = of_few_values(of_one_output(table(rows, 4)));
  for (const llmt::Loss loss : {llmt::Loss::squared, llmt::Loss::tukey}) {
    expect_same_bytes(data, random_counts(rows, 5), {.max_leaves = 6, .loss = loss});
    if (loss != llmt::Loss::squared && sampled(false, true)) continue;
    expect_same_bytes(data, mostly_one(rows), {.max_leaves = 6, .loss = loss});
    expect_same_bytes(data, Counts(rows, 2), {.max_leaves = 6, .loss = loss});
  }
}

TEST(Counts, AreRepeatedRowsOfGroups) {
  llmt::TrainingData data = of_one_output(table(rows, 6));
  for (Eigen::Index i = 0; i < rows; ++i) data.groups.push_back(static_cast<double>(i % 50));
  expect_same_bytes(data, random_counts(rows, 7), {.max_leaves = 6});
  expect_same_bytes(data, Counts(rows, 2), {.max_leaves = 6});
}

TEST(Counts, AreRepeatedRowsWhereTheCallerHoldsRowsOut) {
  llmt::TrainingData data = of_one_output(table(rows, 16));
  for (Eigen::Index i = 2; i < rows; i += 4) data.held_out.push_back(i);
  expect_same_bytes(data, random_counts(rows, 17), {.max_leaves = 6});
  expect_same_bytes(data, mostly_one(rows), {.max_leaves = 6});
}

// The rows that a fold holds out, and the importance that leaves inputs out, are of the rows as they count.
TEST(Counts, AreRepeatedRowsWithUselessInputsAndCodes) {
  constexpr Eigen::Index few = 400;
  llmt::TrainingData data = of_one_output(table(few, 8));
  llmt::Random random(9);
  data.categorical_inputs.clear();
  const std::vector<double> of_code = {0.0, 3.0, -2.0, 1.0};
  for (Eigen::Index i = 0; i < few; ++i) data.outputs(i, 0) += of_code[static_cast<std::size_t>(data.inputs(i, 3))];
  data.inputs.conservativeResize(Eigen::NoChange, 9);
  for (double& value : data.inputs.rightCols(4).reshaped()) value = random.normal();
  const std::vector<Counts> both = {random_counts(few, 10), mostly_one(few)};
  for (const Counts& counts : std::span(both).first(sampled<std::size_t>(2, 1))) {
    llmt::TrainingData of_counts = data;
    of_counts.weights = Eigen::Map<const Eigen::VectorXi>(counts.data(), few).cast<double>();
    const llmt::FitResult result = llmt::fit(of_counts);
    EXPECT_FALSE(result.summary.codes.compared.empty());
    EXPECT_GT(result.summary.partitions[0].input_steps.size(), 1U);
    expect_same(result, llmt::fit(repeated(data, counts)));
  }
}

TEST(Counts, AreRepeatedRowsInAReadableTree) {
  const llmt::TrainingData data = of_one_output(table(rows, 11));
  for (const Counts& counts : {random_counts(rows, 12), mostly_one(rows)}) {
    std::vector<std::string> models;
    for (const llmt::TrainingData& each : {weighted(data, counts), repeated(data, counts)}) {
      const llmt::PreparedFit prepared(each, {.max_leaves = 6});
      models.push_back(to_json(llmt::fit_readable(prepared, llmt::fit(prepared).summary).model));
    }
    EXPECT_TRUE(models[0] == models[1]);
  }
}

TEST(Counts, AreRepeatedRowsInBinsAndWhereOneFoldIsHeldOut) {
  llmt::TrainingData data = of_one_output(table(50000, 13));
  data.inputs.col(4) = data.inputs.col(4).array().isNaN().select(0.5, data.inputs.col(4));
  data.inputs.conservativeResize(Eigen::NoChange, 3);
  data.categorical_inputs.clear();
  llmt::FitOptions options{.max_leaves = 5, .validity = llmt::ValidityChoice::crisp};
  options.expert.search = llmt::SplitSearch::binned;
  Counts counts = mostly_one(50000);
  for (Eigen::Index i = 0; i < 50000; i += 30) ++counts[i];
  llmt::TrainingData of_counts = data;
  of_counts.weights = Eigen::Map<const Eigen::VectorXi>(counts.data(), 50000).cast<double>();
  const llmt::FitResult result = llmt::fit(of_counts, options);
  expect_same(result, llmt::fit(repeated(data, counts), options));
  EXPECT_EQ(result.summary.partitions[0].cv_folds, 1);
  EXPECT_GT(result.summary.partitions[0].search.binned_nodes, 0);
}

// Whole numbers beyond ten on average say how exact a row is, not how often it was measured, as do other numbers.
TEST(Counts, AreNotTakenFromLargeNorFromBrokenWeights) {
  llmt::TrainingData data = weighted(of_one_output(table(rows, 14)), mostly_one(rows));
  const llmt::FitOptions options{.max_leaves = 6, .validity = llmt::ValidityChoice::crisp};
  const auto model_of = [&](double factor) {
    llmt::TrainingData scaled = data;
    scaled.weights *= factor;
    return llmt::fit(scaled, options);
  };
  const llmt::FitResult large = model_of(0x1p20);
  const llmt::FitResult small = model_of(0x1p-20);
  // Intervals know the usual weight; only ratios to it count.
  EXPECT_TRUE(to_json(large.model) == to_json(small.model));
  for (const double ratio : {0.25, 1.0, 9.0}) {
    const auto of = [&](const llmt::FitResult& result, double factor) {
      return result.intervals.predict(data.inputs, 0.9, 1, ratio * factor * data.weights.cwiseMax(1.0));
    };
    EXPECT_EQ(of(large, 0x1p20).lower, of(small, 0x1p-20).lower);
    EXPECT_EQ(of(large, 0x1p20).upper, of(small, 0x1p-20).upper);
  }
  // A fold of counted rows has 601 rows in all folds, one of weighted rows 588.
  const auto residuals = [](const llmt::FitResult& result) {
    Eigen::Index count = 0;
    for (const llmt::HeldOutPart& part : result.intervals.parts()) {
      count += part.residuals.rows() + part.incomplete.rows();
    }
    return count;
  };
  EXPECT_EQ(residuals(model_of(1.0)), rows - 12 + 15);
  EXPECT_EQ(residuals(large), rows - 12);
  EXPECT_EQ(large.summary.samples, rows - 12);
}

// A row that counts twice where rows are no repeats may be held out by two folds.
TEST(Counts, HeldOutRowsAreThoseOfTheGivenTable) {
  const llmt::TrainingData data = of_one_output(table(rows, 15));
  const Counts counts = mostly_one(rows);
  const llmt::FitOptions options{.max_leaves = 4, .validity = llmt::ValidityChoice::crisp};
  const std::vector<std::vector<Eigen::Index>> found = llmt::fit(weighted(data, counts), options).summary.held_out;
  std::vector<Eigen::Index> given;  // of each repeated row
  for (Eigen::Index i = 0; i < rows; ++i) given.insert(given.end(), counts[i], i);
  std::vector<std::vector<Eigen::Index>> expected = llmt::fit(repeated(data, counts), options).summary.held_out;
  for (std::vector<Eigen::Index>& fold : expected) {
    for (Eigen::Index& row : fold) row = given[row];
    fold.erase(std::unique(fold.begin(), fold.end()), fold.end());
  }
  EXPECT_EQ(found, expected);
}

}  // namespace
}  // namespace counts_of_rows
