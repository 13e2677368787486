// Sums of few rows: shares of variants, their linear start, and the error that is said.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "boosted/average.hpp"
#include "boosted/linear_start.hpp"
#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "some_rows.hpp"

namespace {

using boosted_tests::Rows;
using boosted_tests::some_rows;

TEST(SharesOf, AreTheBestOnAGrid) {
  llmt::Random random(1);
  for (int sample = 0; sample < 20; ++sample) {
    Eigen::MatrixXd residuals(40, 3);
    Eigen::VectorXd weights(40);
    for (Eigen::Index i = 0; i < 40; ++i) {
      const double common = random.normal();
      for (Eigen::Index k = 0; k < 3; ++k)
        residuals(i, k) = common + random.normal() * static_cast<double>(k + 1) / 3.0;
      weights(i) = 0.5 + random.uniform();
    }
    std::vector<int> rows;
    for (int row = 5; row < 40; ++row) rows.push_back(row);
    const Eigen::VectorXd shares = llmt::shares_of(residuals, weights, rows);
    EXPECT_GE(shares.minCoeff(), 0.0);
    EXPECT_NEAR(shares.sum(), 1.0, 1e-12);
    const auto squares = [&](const Eigen::Vector3d& a) {
      double sum = 0.0;
      double weight = 0.0;
      Eigen::Vector3d alone = Eigen::Vector3d::Zero();
      for (const int row : rows) {
        sum += weights(row) * std::pow(residuals.row(row).dot(a), 2);
        alone += weights(row) * residuals.row(row).transpose().cwiseAbs2();
        weight += weights(row);
      }
      return (sum + alone.minCoeff() / std::sqrt(35.0) * a.squaredNorm()) / weight;
    };
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= 100; ++i) {
      for (int j = 0; i + j <= 100; ++j) best = std::min(best, squares({i / 100.0, j / 100.0, (100 - i - j) / 100.0}));
    }
    EXPECT_LE(squares(shares), best * (1.0 + 1e-12));
    EXPECT_GE(squares(shares), best * (1.0 - 1e-3));  // the grid is that fine
  }
}

// Slopes and constant of ridge with the penalty p on the slopes, from the normal equations.
Eigen::VectorXd ridge(const Eigen::MatrixXd& z, const Eigen::VectorXd& y, const Eigen::VectorXd& w, double p) {
  Eigen::MatrixXd a(z.rows(), z.cols() + 1);
  a << Eigen::VectorXd::Ones(z.rows()), z;
  Eigen::MatrixXd gram = a.transpose() * w.asDiagonal() * a;
  gram.diagonal().tail(z.cols()).array() += p;
  return gram.llt().solve(a.transpose() * w.cwiseProduct(y));
}

TEST(LinearStart, IsTheRidgeOfTheSmallestLeaveOneOutError) {
  int inner = 0;  // penalties that are neither the smallest nor the largest one
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Rows rows = some_rows(30, 5, false, 0.1, seed);
    for (int i = 0; i < 30; ++i) rows.binned.weights(i) = 1 + i % 3;  // whole: a row of weight k is k rows
    Eigen::MatrixXd z = rows.z;
    for (double& value : z.reshaped()) value = std::isnan(value) ? 0.0 : value;
    const Eigen::VectorXd& w = rows.binned.weights;
    double best = std::numeric_limits<double>::infinity();
    Eigen::VectorXd expected;
    int taken = 0;
    for (int step = -10; step <= 4; ++step) {
      const double penalty = w.sum() * std::pow(10.0, 0.5 * step);
      double error = 0.0;
      for (Eigen::Index i = 0; i < 30; ++i) {
        Eigen::VectorXd without = w;
        without(i) -= 1.0;
        // Centred with the row, as the short formula is: the constant has no penalty, so it makes no difference.
        const Eigen::VectorXd b = ridge(z, rows.y, without, penalty);
        error += w(i) * std::pow(rows.y(i) - b(0) - z.row(i).dot(b.tail(5)), 2);
      }
      if (error >= best) continue;
      best = error;
      expected = ridge(z, rows.y, w, penalty);
      taken = step;
    }
    inner += taken > -10 && taken < 4 ? 1 : 0;
    const std::vector<llmt::BoostedTree> trees = llmt::linear_start(rows.binned, rows.y, rows.all);
    ASSERT_EQ(trees.size(), 5U);
    for (int j = 0; j < 5; ++j) EXPECT_NEAR(trees[j].leaves.front().slopes.front(), expected(j + 1), 1e-6) << seed;
    EXPECT_LT((llmt::values_of(trees, rows.binned) - z * expected.tail(5)).cwiseAbs().maxCoeff(), 1e-5);
  }
  EXPECT_GT(inner, 2);
}

TEST(SumOfParts, IsTheirWeightedMean) {
  const Rows rows = some_rows(60, 3, false, 0.0, 7);
  llmt::Random random(8);
  const llmt::Progress nobody;
  llmt::Work work(nobody);
  std::vector<llmt::SumPart> parts;
  Eigen::VectorXd expected = Eigen::VectorXd::Constant(60, 5.0);
  for (const double rate : {0.1, 0.3}) {
    llmt::SumPart part{.share = rate == 0.1 ? 0.25 : 0.75, .rate = rate, .rounds = {}};
    if (rate == 0.3) part.start = llmt::linear_start(rows.binned, rows.y, rows.all);
    const Eigen::VectorXd start = llmt::values_of(part.start, rows.binned);
    const llmt::RoundOptions options{.rate = rate, .most_rounds = 4};
    part.rounds = llmt::boost(rows.binned, rows.y - start, rows.all, {}, {}, options, random, work);
    expected += 2.0 * part.share * (rows.y - part.rounds.residuals);
    parts.push_back(std::move(part));
  }
  std::vector<llmt::InputColumn> inputs;
  for (const char* name : {"a", "b", "c"}) inputs.push_back({.name = name, .low = -9.0, .high = 9.0});
  const llmt::BoostedModel model(inputs, {{.name = "y", .low = -9.0, .high = 9.0}}, {1.0, 1.0, 1.0},
                                 {llmt::sum_of(parts, rows.binned, 5.0, 2.0)});
  EXPECT_EQ(model.sums().front().trees.size(), 4U + 3U + 4U);
  EXPECT_LT((model.predict(rows.z).col(0) - expected).cwiseAbs().maxCoeff(), 1e-9);
}

// One tree is a linear model where nothing else is true. A sum cannot say a tree of rows with empty cells; a variant
// that starts from a linear model is there in its place.
TEST(FitBoosted, KnowsALinearModelOfFewRowsWithEmptyCells) {
  llmt::Random random(3);
  llmt::TrainingData data;
  data.inputs.resize(120, 3);
  for (double& value : data.inputs.reshaped()) value = random.normal();
  data.outputs = 2.0 * data.inputs.col(0) - data.inputs.col(1) + 0.5 * data.inputs.col(2);
  const auto names_of = [&] {
    std::string names;
    const llmt::BoostSummary summary = llmt::fit_boosted(data).summaries[0];
    for (const llmt::BoostVariant& variant : summary.compared) names += variant.name + "; ";
    EXPECT_GT(summary.compared.back().share, 0.9) << names;
    return names;
  };
  EXPECT_EQ(names_of(), "symmetric; soft; one tree; ");
  data.inputs(4, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(names_of(), "symmetric; soft; soft from a linear model; ");
}

// Numbers of trees and shares that a row had a say in would make its error too small: without a signal, too, the error
// is at least that of the mean.
TEST(FitBoosted, SaysTheErrorOfTheWholeProcedureForFewRows) {
  llmt::Random random(9);
  double said = 0.0;
  constexpr int samples = 20;
  for (int sample = 0; sample < samples; ++sample) {
    llmt::TrainingData data;
    data.inputs.resize(60, 4);
    data.outputs.resize(60, 1);
    for (double& value : data.inputs.reshaped()) value = random.normal();
    for (double& value : data.outputs.reshaped()) value = random.normal();
    const llmt::BoostSummary summary = llmt::fit_boosted(data).summaries[0];
    said += summary.rmse * summary.rmse / samples;
    ASSERT_EQ(summary.compared.size(), 3U);
    double shares = 0.0;
    for (const llmt::BoostVariant& variant : summary.compared) shares += variant.share;
    EXPECT_NEAR(shares, 1.0, 1e-12);
  }
  EXPECT_GT(said, 0.97);
  EXPECT_LT(said, 1.2);
}

}  // namespace
