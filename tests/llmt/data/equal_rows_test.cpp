// Rows that repeat other rows.
#include "data/equal_rows.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <vector>

#include "llmt/compare.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "oracles/oracles.hpp"
#include "study.hpp"

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

// Part of 60 tables whose rows are taken for repeats.
double part_of_repeats(const std::function<Eigen::MatrixXd(llmt::Random&)>& draw) {
  llmt::Random random(20261128);
  double count = 0.0;
  for (int k = 0; k < 60; ++k) {
    const Eigen::MatrixXd x = draw(random);
    count += repeats(x, all_of(x.rows())) ? 1.0 : 0.0;
  }
  return count / 60.0;
}

Eigen::Index between(llmt::Random& random, double low, double high) {
  return static_cast<Eigen::Index>(random.uniform(low, high));
}

// Rows of `settings`, each as often as `count` says.
Eigen::MatrixXd repeated(const Eigen::MatrixXd& settings, const std::function<Eigen::Index()>& count) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < settings.rows(); ++i) rows.insert(rows.end(), static_cast<std::size_t>(count()), i);
  return settings(rows, Eigen::all);
}

TEST(EqualRows, OfManyKindsOfTables) {
  const auto normal = [](llmt::Random& random, Eigen::Index rows, Eigen::Index columns) -> Eigen::MatrixXd {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
  };
  // Few values: every column has levels of unequal frequency.
  EXPECT_LE(part_of_repeats([&](llmt::Random& random) -> Eigen::MatrixXd {
              Eigen::MatrixXd x = normal(random, between(random, 60, 2000), between(random, 1, 8));
              for (auto column : x.colwise()) column = (column.array() * random.uniform(0.4, 2.0)).round().eval();
              return x;
            }),
            0.05);
  // A number with few digits, as a rounded measurement.
  EXPECT_EQ(part_of_repeats([&](llmt::Random& random) -> Eigen::MatrixXd {
              return (normal(random, between(random, 60, 2000), 1).array() * random.uniform(3.0, 100.0)).round();
            }),
            0.0);
  // A catalogue with copies of some of its rows.
  EXPECT_EQ(part_of_repeats([&](llmt::Random& random) -> Eigen::MatrixXd {
              const Eigen::MatrixXd x = normal(random, between(random, 100, 2000), between(random, 3, 8));
              const Eigen::Index copies = between(random, 0.02, 0.3 * static_cast<double>(x.rows()));
              Eigen::MatrixXd both(x.rows() + copies, x.cols());
              both << x, x.topRows(copies);
              return both;
            }),
            0.0);
  // A factorial with replicates, of which some rows were lost.
  for (const double lost : {0.0, 0.1, 0.3}) {
    EXPECT_EQ(part_of_repeats([&](llmt::Random& random) -> Eigen::MatrixXd {
                Eigen::MatrixXd cells(between(random, 3, 6) * 4 * 3, 3);
                for (Eigen::Index i = 0; i < cells.rows(); ++i) cells.row(i) << i / 12, i / 3 % 4, i % 3;
                const Eigen::Index replicates = between(random, 3, 12);
                return repeated(cells, [&] {
                  Eigen::Index kept = 0;
                  for (Eigen::Index k = 0; k < replicates; ++k) kept += random.uniform(0.0, 1.0) >= lost ? 1 : 0;
                  return kept;
                });
              }),
              1.0);
  }
  // A log of states: equally long, and of lengths that scatter as much as their mean.
  EXPECT_EQ(part_of_repeats([&](llmt::Random& random) -> Eigen::MatrixXd {
              const Eigen::Index rows = between(random, 2, 60);
              return repeated(normal(random, between(random, 20, 100), between(random, 1, 6)), [&] { return rows; });
            }),
            1.0);
  EXPECT_EQ(part_of_repeats([&](llmt::Random& random) -> Eigen::MatrixXd {
              const double mean = random.uniform(4.0, 9.0);
              const auto length = [&] { return 1 + between(random, 0.0, -mean * std::log(random.uniform(0.01, 1.0))); };
              return repeated(normal(random, between(random, 20, 100), between(random, 2, 6)), length);
            }),
            1.0);
}

TEST(EqualRows, OfNumbersAreRepeatsAndOfFewValuesAreNot) {
  const Eigen::MatrixXd x = oracle::uniform(300, 4, 1);
  EXPECT_FALSE(repeats(x, all_of(300)));
  EXPECT_TRUE(repeats(times(x, 2), all_of(600)));
  EXPECT_TRUE(repeats(times(x.leftCols(1), 3), all_of(900)));
  // Four questions with five answers each.
  const Eigen::MatrixXd answers = (2.5 * (oracle::uniform(1000, 4, 2).array() + 1.0)).floor();
  EXPECT_FALSE(repeats(answers, all_of(1000)));
  // Nine settings are too few to tell.
  EXPECT_FALSE(repeats(times(x.topRows(9), 4), all_of(36)));
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

// The log of the newcomer: states, each measured five times by sensors whose last digits differ, and what the sensors
// do not say of a state moves the output. `jitter`: of the sensors, relative to their range.
struct Log {
  Eigen::MatrixXd x, y, new_x, new_y;
};

Log log_of_states(double jitter, bool has_time, std::uint64_t seed) {
  constexpr Eigen::Index states = 120, times_read = 5;
  llmt::Random random(seed);
  const auto draw = [&](Eigen::Index count, Eigen::Index reads, double first, Eigen::MatrixXd& x, Eigen::MatrixXd& y) {
    x.resize(count * reads, has_time ? 4 : 3);
    y.resize(count * reads, 1);
    for (Eigen::Index i = 0; i < count; ++i) {
      const double a = random.uniform(-1.0, 1.0), b = random.uniform(-1.0, 1.0), c = random.uniform(-1.0, 1.0);
      const double of_state = 2.0 * a + b * c + 0.5 * random.normal();
      for (Eigen::Index k = 0; k < reads; ++k) {
        const Eigen::Index row = i * reads + k;
        x.row(row).head(3) << a + jitter * random.normal(), b + jitter * random.normal(), c + jitter * random.normal();
        if (has_time) x(row, 3) = first + 10.0 * static_cast<double>(row);
        y(row, 0) = of_state + 0.02 * random.normal();
      }
    }
  };
  Log log;
  draw(states, times_read, 1.7e9, log.x, log.y);
  draw(1000, 1, 1.7e9, log.new_x, log.new_y);
  return log;
}

TEST(EqualRows, ThatDifferInTheLastDigitsAreRepeats) {
  for (const bool has_time : {false, true}) {
    for (const double jitter : {1e-15, 1e-7, 0.0, 1e-12, 1e-9}) {
      if (sampled(false, jitter != 1e-15 && jitter != 1e-7)) continue;
      const Log log = log_of_states(jitter, has_time, 5);
      const llmt::FitResult result = llmt::fit(log.x, log.y);
      EXPECT_TRUE(result.summary.repeats) << jitter;
      const double printed = result.summary.partitions[0].chosen.rmse;
      const double paid = llmt::rmse(result.model.predict(log.new_x), log.new_y)(0);
      EXPECT_GT(printed / paid, 0.8) << jitter << " " << has_time;
      EXPECT_LT(printed / paid, 1.25) << jitter << " " << has_time;
      EXPECT_LT(paid, 0.75) << jitter << " " << has_time;
      ASSERT_TRUE(result.summary.partitions[0].equal_rows);
      EXPECT_NEAR(result.summary.partitions[0].equal_rows->rmse_known(0), 0.02, 0.003);
      EXPECT_NEAR(result.summary.partitions[0].equal_rows->rmse_new(0), printed, 1e-9 * printed);
    }
  }
}

// A column that grows is left out of the comparison only where the others make repeats of the rows, and not if it is
// all that there is.
TEST(EqualRows, AreAskedWithoutAColumnThatRuns) {
  const Eigen::MatrixXd settings = oracle::uniform(40, 2, 3);
  Eigen::MatrixXd x(160, 3);
  x << Eigen::VectorXd::LinSpaced(160, 1.7e9, 1.7e9 + 159.0), times(settings, 4);
  EXPECT_TRUE(repeats(x, all_of(160)));
  x.col(0).reverseInPlace();
  EXPECT_TRUE(repeats(x, all_of(160)));
  std::swap(x(3, 0), x(90, 0));
  EXPECT_FALSE(repeats(x, all_of(160)));
  EXPECT_FALSE(repeats(Eigen::VectorXd::LinSpaced(160, 0.0, 1.0), all_of(160)));
}

// Of rows that meet but are no repeats, those that met a training row are told from the others.
TEST(EqualRows, ErrorsOfRowsThatMeetAreToldApart) {
  Eigen::MatrixXd x(330, 3);
  x << oracle::uniform(300, 3, 5), oracle::uniform(300, 3, 5).topRows(30);
  const Eigen::MatrixXd own = oracle::uniform(300, 1, 8);
  Eigen::MatrixXd y(330, 1);
  y << x.topRows(300).rowwise().sum() + own,
      x.bottomRows(30).rowwise().sum() + own.topRows(30) + 0.01 * oracle::uniform(30, 1, 9);
  const llmt::FitResult result = llmt::fit(x, y, {.intervals = true});
  EXPECT_FALSE(result.summary.repeats);
  ASSERT_TRUE(result.summary.partitions[0].equal_rows);
  const llmt::EqualRowErrors& errors = *result.summary.partitions[0].equal_rows;
  // By the models of the folds, and by comparing all rows with all others.
  double squares_new = 0.0, squares_known = 0.0;
  Eigen::Index rows_new = 0, rows_known = 0;
  for (std::size_t f = 0; f < result.summary.held_out.size(); ++f) {
    const std::vector<Eigen::Index>& held_out = result.summary.held_out[f];
    for (const Eigen::Index row : held_out) {
      bool meets = false;
      for (Eigen::Index other = 0; other < 330; ++other) {
        meets |= other != row && x.row(other) == x.row(row) && !std::ranges::binary_search(held_out, other);
      }
      const double error = result.intervals.models()[f].predict(x.row(row))(0) - y(row, 0);
      (meets ? squares_known : squares_new) += error * error;
      ++(meets ? rows_known : rows_new);
    }
  }
  EXPECT_EQ(errors.rows_new, rows_new);
  EXPECT_EQ(errors.rows_known, rows_known);
  EXPECT_GT(rows_known, 30);
  EXPECT_NEAR(errors.rmse_new(0), std::sqrt(squares_new / static_cast<double>(rows_new)), 1e-9);
  EXPECT_NEAR(errors.rmse_known(0), std::sqrt(squares_known / static_cast<double>(rows_known)), 1e-9);
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
