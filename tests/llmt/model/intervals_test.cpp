// Prediction intervals of complete rows and of rows that lack an input.
#include "llmt/intervals.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "llmt/files.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "oracles/samples.hpp"
#include "oracles/thrown.hpp"

namespace {

using oracle::Sample;

// y = 10 a + b + noise of 0.1; `share` of the rows lack a, and a third input that does nothing lacks a fifth of its
// values.
Sample lacking(Eigen::Index rows, double share, std::uint64_t seed) {
  llmt::Random random(seed);
  Sample s{Eigen::MatrixXd(rows, 3), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    s.x.row(i) << random.uniform(), random.uniform(), 0.0;
    s.y(i, 0) = 10.0 * s.x(i, 0) + s.x(i, 1) + 0.1 * random.normal();
    if (random.uniform() < share) s.x(i, 0) = oracle::missing;
    if (random.uniform() < 0.2) s.x(i, 2) = oracle::missing;
  }
  return s;
}

// A row is incomplete if it lacks the first input; the third one is constant, so no model uses it.
bool is_incomplete(const Sample& s, Eigen::Index row) { return std::isnan(s.x(row, 0)); }

// The folds' models with their spreads, and their predictions, one column a model.
struct Folds {
  const llmt::FitResult& fit;

  double spread(std::size_t fold, const Eigen::RowVectorXd& x) const {
    const std::vector<llmt::Spread>& spreads = fit.intervals.parts()[fold].spreads;
    return spreads.empty() ? 1.0 : llmt::spread_at(spreads[0], Eigen::MatrixXd(x), 0, predictions(x)(fold));
  }

  Eigen::VectorXd predictions(const Eigen::RowVectorXd& x) const {
    Eigen::VectorXd result(std::ssize(fit.intervals.models()));
    for (Eigen::Index f = 0; f < result.size(); ++f) result(f) = fit.intervals.models()[f].predict(x)(0, 0);
    return result;
  }

  // tau^2 of (I.3).
  double usual_disagreement(const Sample& train) const {
    const std::vector<std::vector<Eigen::Index>>& held_out = fit.summary.held_out;
    const auto count = static_cast<double>(held_out.size());
    double squares = 0.0;
    for (std::size_t f = 0; f < held_out.size(); ++f) {
      std::vector<double> sizes;
      for (const Eigen::Index row : held_out[f]) {
        const Eigen::VectorXd of_models = predictions(train.x.row(row));
        sizes.push_back(std::abs(of_models(f) - of_models.mean()) / spread(f, train.x.row(row)));
      }
      std::ranges::sort(sizes);
      squares += std::pow(sizes[sizes.size() / 2] * std::sqrt(count / (count - 1.0)) / 0.6744897501960817, 2) / count;
    }
    return squares;
  }
};

// The ends over the given kinds of held-out rows, by sorting all values; the m-th from outside.
struct Ends {
  double lower;
  double upper;
};
Ends sorted_ends(const llmt::FitResult& fit, const Sample& train, bool complete, bool incomplete,
                 const Eigen::RowVectorXd& x, std::size_t m) {
  const std::vector<std::vector<Eigen::Index>>& held_out = fit.summary.held_out;
  const Folds folds{fit};
  Eigen::VectorXd spreads(std::ssize(held_out));
  for (std::size_t f = 0; f < held_out.size(); ++f) spreads(f) = folds.spread(f, x);
  Eigen::VectorXd predicted = folds.predictions(x);
  const double mean = predicted.mean();
  const double variance = (predicted.array() - mean).square().sum() / static_cast<double>(predicted.size() - 1);
  const double usual = folds.usual_disagreement(train) * spreads.squaredNorm() / static_cast<double>(spreads.size());
  const double left = std::sqrt(std::max(0.0, 1.0 - usual / variance));
  predicted = mean + left * (predicted.array() - mean);
  std::vector<double> lower;
  std::vector<double> upper;
  for (std::size_t f = 0; f < held_out.size(); ++f) {
    for (const Eigen::Index row : held_out[f]) {
      if (!(is_incomplete(train, row) ? incomplete : complete)) continue;
      const double of_row = folds.predictions(train.x.row(row))(f);
      const double width = std::abs(train.y(row, 0) - of_row) / folds.spread(f, train.x.row(row)) * spreads(f);
      lower.push_back(predicted(f) - width);
      upper.push_back(predicted(f) + width);
    }
  }
  std::ranges::sort(lower);
  std::ranges::sort(upper);
  return {lower[m - 1], upper[upper.size() - m]};
}

Eigen::Index count_incomplete(const Sample& s) { return s.x.col(0).array().isNaN().count(); }

Eigen::Index outside(double level, Eigen::Index rows) {
  return static_cast<Eigen::Index>(std::floor((1.0 - level) * static_cast<double>(rows + 1) + 1e-9));
}

Eigen::MatrixXd complete_and_incomplete() {
  Eigen::MatrixXd x(3, 3);
  x << 0.3, 0.6, 0.0, oracle::missing, 0.2, 0.0, 0.7, 0.1, oracle::missing;
  return x;
}

TEST(Intervals, AreTheSortedValuesOfHeldOutRowsOfTheKindOfTheRow) {
  const Sample train = lacking(300, 0.2, 3);
  const llmt::FitResult fit = llmt::fit(train.x, train.y);
  const Eigen::MatrixXd x = complete_and_incomplete();
  const llmt::Bounds bounds = fit.intervals.predict(x, 0.9);
  EXPECT_TRUE(bounds.uncalibrated.empty());
  const Eigen::Index lacks = count_incomplete(train);
  for (const Eigen::Index row : {0, 1, 2}) {
    const bool incomplete = row == 1;
    const Eigen::Index m = outside(0.9, incomplete ? lacks : 300 - lacks);
    const Ends ends = sorted_ends(fit, train, !incomplete, incomplete, x.row(row), static_cast<std::size_t>(m));
    EXPECT_NEAR(bounds.lower(row, 0), ends.lower, 1e-12) << row;
    EXPECT_NEAR(bounds.upper(row, 0), ends.upper, 1e-12) << row;
  }
}

// With fewer than nine rows of the kind no interval of theirs has 90 %.
TEST(Intervals, OfTooFewRowsOfAKindReachToThoseOfAllRowsAndToTheLargestOfTheKind) {
  const Sample train = lacking(300, 0.02, 5);
  const Eigen::Index lacks = count_incomplete(train);
  ASSERT_GT(lacks, 0);
  ASSERT_LT(lacks, 9);
  const llmt::FitResult fit = llmt::fit(train.x, train.y);
  const Eigen::MatrixXd x = complete_and_incomplete();
  const llmt::Bounds bounds = fit.intervals.predict(x, 0.9);
  EXPECT_EQ(bounds.uncalibrated, std::vector<Eigen::Index>{1});
  const Ends all = sorted_ends(fit, train, true, true, x.row(1), static_cast<std::size_t>(outside(0.9, 300)));
  const Ends largest = sorted_ends(fit, train, false, true, x.row(1), 1);
  EXPECT_NEAR(bounds.lower(1, 0), std::min(all.lower, largest.lower), 1e-12);
  EXPECT_NEAR(bounds.upper(1, 0), std::max(all.upper, largest.upper), 1e-12);
  EXPECT_GT(bounds.upper(1, 0) - bounds.lower(1, 0), all.upper - all.lower);
}

TEST(Intervals, OfAnIncompleteRowAreThoseOfAllRowsWhereTrainingWasComplete) {
  const Sample train = lacking(300, 0.0, 7);
  const llmt::FitResult fit = llmt::fit(train.x, train.y);
  const Eigen::MatrixXd x = complete_and_incomplete();
  const llmt::Bounds bounds = fit.intervals.predict(x, 0.9);
  EXPECT_EQ(bounds.uncalibrated, std::vector<Eigen::Index>{1});
  const Ends all = sorted_ends(fit, train, true, true, x.row(1), static_cast<std::size_t>(outside(0.9, 300)));
  EXPECT_NEAR(bounds.lower(1, 0), all.lower, 1e-12);
  EXPECT_NEAR(bounds.upper(1, 0), all.upper, 1e-12);
}

// CV+ guarantees 80 % at the level 0.9. Calibrated with all other rows, a tenth of the incomplete ones would be inside.
TEST(Intervals, CoverCompleteAndIncompleteRowsAlike) {
  double complete = 0.0;
  double incomplete = 0.0;
  constexpr int seeds = 8;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    const Sample train = lacking(500, 0.07, 100 + seed);
    const Sample test = lacking(4000, 0.07, 200 + seed);
    const llmt::Bounds bounds = llmt::fit(train.x, train.y).intervals.predict(test.x, 0.9);
    Eigen::Vector2d inside(0.0, 0.0);
    for (Eigen::Index row = 0; row < 4000; ++row) {
      const double y = test.y(row, 0);
      inside(is_incomplete(test, row) ? 1 : 0) += y >= bounds.lower(row, 0) && y <= bounds.upper(row, 0) ? 1.0 : 0.0;
    }
    const auto lacks = static_cast<double>(count_incomplete(test));
    complete += inside(0) / (4000.0 - lacks) / seeds;
    incomplete += inside(1) / lacks / seeds;
  }
  EXPECT_GT(complete, 0.8);
  EXPECT_LT(complete, 0.97);
  EXPECT_GT(incomplete, 0.8);
  EXPECT_LT(incomplete, 0.97);
}

// An unknown category is missing, and no row of training was like it. Empty cells are a level here, as complete as
// others.
TEST(Intervals, AnUnknownCategoryIsMissing) {
  Sample train = lacking(300, 0.0, 9);
  train.x.col(0) = (3.0 * train.x.col(0)).array().floor();
  for (Eigen::Index row = 0; row < 40; ++row) train.x(row, 0) = oracle::missing;
  const llmt::FitResult fit = llmt::fit({.inputs = train.x, .outputs = train.y, .categorical_inputs = {0}});
  Eigen::MatrixXd x(2, 3);
  x << 7.0, 0.5, 0.0, oracle::missing, 0.5, 0.0;
  const llmt::Bounds bounds = fit.intervals.predict(x, 0.9);
  EXPECT_EQ(bounds.uncalibrated, std::vector<Eigen::Index>{0});
}

TEST(Intervals, ReadBackWithBothKindsOfRows) {
  const Sample train = lacking(200, 0.2, 11);
  const llmt::FitResult fit = llmt::fit(train.x, train.y);
  const std::string path = testing::TempDir() + "/llmt_intervals_test.json";
  llmt::save(fit.model, fit.intervals, path);
  const llmt::Intervals read = llmt::load_with_intervals(path).intervals;
  ASSERT_EQ(read.models().size(), fit.intervals.models().size());
  Eigen::Index lacks = 0;
  for (std::size_t f = 0; f < read.models().size(); ++f) {
    EXPECT_EQ(read.parts()[f].residuals, fit.intervals.parts()[f].residuals);
    EXPECT_EQ(read.parts()[f].incomplete, fit.intervals.parts()[f].incomplete);
    EXPECT_EQ(read.parts()[f].spreads, fit.intervals.parts()[f].spreads);
    lacks += read.parts()[f].incomplete.rows();
  }
  EXPECT_EQ(lacks, count_incomplete(train));
  const Sample whole = lacking(200, 0.0, 11);
  const llmt::FitResult complete = llmt::fit(whole.x, whole.y);
  llmt::save(complete.model, complete.intervals, path);
  EXPECT_EQ(llmt::read_file(path).find("residuals_incomplete"), std::string::npos);
  std::filesystem::remove(path);
}

TEST(Intervals, ATextWithThemIsTheFileAndGivesTheSameBytesAgain) {
  const Sample train = lacking(200, 0.2, 11);
  const llmt::FitResult fit = llmt::fit(train.x, train.y);
  const std::string text = llmt::to_json(fit.model, fit.intervals);
  const llmt::ModelWithIntervals read = llmt::from_json_with_intervals(text);
  EXPECT_EQ(llmt::to_json(read.model, read.intervals), text);
  const Eigen::MatrixXd x = complete_and_incomplete();
  EXPECT_EQ(read.intervals.predict(x, 0.9).upper, fit.intervals.predict(x, 0.9).upper);
  const std::string path = testing::TempDir() + "/llmt_intervals_text_test.json";
  llmt::save(fit.model, fit.intervals, path);
  EXPECT_EQ(llmt::read_file(path), text);
  std::filesystem::remove(path);
  const std::string alone = llmt::to_json(fit.model);
  EXPECT_EQ(llmt::to_json(fit.model, llmt::Intervals()), alone);
  EXPECT_TRUE(llmt::from_json_with_intervals(alone).intervals.empty());
}

TEST(Intervals, ATextThatIsCutOffOrAlteredIsRefusedWithThePlace) {
  const Sample train = lacking(100, 0.2, 11);
  const llmt::FitResult fit = llmt::fit(train.x, train.y);
  std::string text = llmt::to_json(fit.model, fit.intervals);
  const auto refusal = [](const std::string& of) {
    return oracle::thrown<std::runtime_error>([&] { llmt::from_json_with_intervals(of, "m.json"); });
  };
  const std::size_t residuals = text.find("\"residuals\"");
  const std::size_t number = text.find_first_of("0123456789", residuals);
  EXPECT_EQ(refusal(text.substr(0, number)).find("m.json: not JSON, or cut off: "), 0U);
  EXPECT_NE(refusal(text.substr(0, number)).find(", in /intervals/0/parts/0/residuals/0"), std::string::npos);
  text.insert(number, "-");
  EXPECT_EQ(refusal(text).find("m.json: /intervals: "), 0U) << refusal(text);
}

TEST(Intervals, WithoutFoldsAreRefusedWithTheOptionsThatMakeThem) {
  const Sample train = lacking(60, 0.0, 13);
  llmt::FitOptions options;
  options.intervals = false;
  const llmt::FitResult fit = llmt::fit(train.x, train.y, options);
  EXPECT_EQ(oracle::thrown([&] { fit.intervals.predict(train.x, 0.9); }),
            "llmt::Intervals: there are no held-out residuals; fit with folds and with FitOptions::intervals = true");
}

}  // namespace
