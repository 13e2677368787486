// Whether predictions are clamped to the range of the training rows is chosen on held-out rows:
// docs/algorithms/guards.md, B.5.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/folds.hpp"
#include "oracles/clamped.hpp"
#include "oracles/oracles.hpp"

namespace {

using oracle::percentages;
using oracle::Percentages;

constexpr double open = std::numeric_limits<double>::infinity();

llmt::FitOptions options() {
  llmt::FitOptions result;
  result.max_leaves = 24;
  return result;
}

// Cut off at -1 and 1.
Eigen::VectorXd cut_off(const Eigen::MatrixXd& x) {
  const Eigen::ArrayXd latent = 2.0 * x.col(0).array() + (3.0 * x.col(1).array()).sin();
  return latent.max(-1.0).min(1.0);
}

Eigen::VectorXd noisy_plane(const Eigen::MatrixXd& x) {
  llmt::Random random(3);
  Eigen::VectorXd y = 2.0 * x.col(0) - x.col(1);
  for (double& value : y) value += 0.1 * random.normal();
  return y;
}

const llmt::FitResult& fitted_percentages() {
  static const llmt::FitResult result = [] {
    const Percentages data = percentages(1500, 1);
    return llmt::fit(data.x, data.y, options());
  }();
  return result;
}

TEST(RangeGuard, IsTakenWhereATargetIsBounded) {
  const llmt::FitResult& result = fitted_percentages();
  const llmt::PartitionSummary& summary = result.summary.partitions[0];
  ASSERT_EQ(summary.range_guards.size(), 1U);
  const llmt::RangeGuard& guard = summary.range_guards[0];
  EXPECT_TRUE(guard.taken);
  EXPECT_LT(guard.rmse_with, 0.97 * guard.rmse_without);
  EXPECT_EQ(summary.chosen.rmse, guard.rmse_with);
  EXPECT_EQ(result.model.partitions()[0].output_range, Eigen::RowVector2d(0.0, 100.0));
  const Percentages fresh = percentages(4000, 2);
  const Eigen::MatrixXd predicted = result.model.predict(fresh.x);
  EXPECT_EQ(predicted.minCoeff(), 0.0);
  EXPECT_EQ(predicted.maxCoeff(), 100.0);
  EXPECT_LT(llmt::rmse(predicted, fresh.y)(0),
            0.97 * llmt::rmse(oracle::unclamped(result.model).predict(fresh.x), fresh.y)(0));
  const Percentages data = percentages(1500, 1);
  EXPECT_NEAR(result.summary.partitions[0].train_rmse(0), llmt::rmse(result.model.predict(data.x), data.y)(0), 1e-9);
}

// From the folds' models, which the intervals keep, and from their residuals.
TEST(RangeGuard, TheErrorsAreThoseOfTheFoldsModels) {
  const llmt::FitResult& result = fitted_percentages();
  const llmt::RangeGuard& guard = result.summary.partitions[0].range_guards[0];
  const llmt::CandidateError& chosen = result.summary.partitions[0].chosen;
  const Percentages data = percentages(1500, 1);
  const std::vector<llmt::Fold> folds = llmt::make_folds(1500, options().folds);
  ASSERT_EQ(result.intervals.models().size(), folds.size());
  double squares = 0.0;
  double squares_without = 0.0;
  for (std::size_t f = 0; f < folds.size(); ++f) {
    const llmt::Model& model = result.intervals.models()[f];
    const Eigen::MatrixXd x = data.x(folds[f].held_out, Eigen::all);
    const Eigen::MatrixXd y = data.y(folds[f].held_out, Eigen::all);
    const double of_fold = (model.predict(x) - y).squaredNorm();
    squares += of_fold;
    squares_without += (oracle::unclamped(model).predict(x) - y).squaredNorm();
    EXPECT_NEAR(chosen.fold_rmse(f), std::sqrt(of_fold / static_cast<double>(x.rows())), 1e-12);
    EXPECT_EQ(result.intervals.parts()[f].residuals.rows(), x.rows());
  }
  EXPECT_NEAR(guard.rmse_with, std::sqrt(squares / 1500.0), 1e-12);
  EXPECT_NEAR(guard.rmse_without, std::sqrt(squares_without / 1500.0), 1e-12);
}

TEST(RangeGuard, EachFoldHasTheRangeOfItsOwnRows) {
  Percentages data = percentages(800, 4);
  data.y(17, 0) = -30.0;  // held out in one fold
  data.y(18, 0) = 120.0;
  const llmt::FitResult result = llmt::fit(data.x, data.y, options());
  ASSERT_TRUE(result.summary.partitions[0].range_guards[0].taken);
  EXPECT_EQ(result.model.partitions()[0].output_range, Eigen::RowVector2d(-30.0, 120.0));
  const std::vector<llmt::Fold> folds = llmt::make_folds(800, options().folds);
  for (std::size_t f = 0; f < folds.size(); ++f) {
    const Eigen::VectorXd y = data.y(folds[f].train, 0);
    EXPECT_EQ(result.intervals.models()[f].partitions()[0].output_range,
              Eigen::RowVector2d(y.minCoeff(), y.maxCoeff()));
  }
}

TEST(RangeGuard, IsNotTakenWhereATargetGoesOn) {
  const Eigen::MatrixXd x = oracle::uniform(400, 2, 5);
  for (const Eigen::VectorXd& y : {noisy_plane(x), Eigen::VectorXd(2.0 * x.col(0) - x.col(1))}) {
    const llmt::FitResult result = llmt::fit(x, y, options());
    const llmt::RangeGuard& guard = result.summary.partitions[0].range_guards[0];
    EXPECT_FALSE(guard.taken);
    EXPECT_EQ(result.model.partitions()[0].output_range.size(), 0);
    for (const llmt::Model& fold : result.intervals.models()) {
      EXPECT_EQ(fold.partitions()[0].output_range.size(), 0);
    }
    EXPECT_NEAR(result.model.predict(Eigen::RowVector2d(3.0, -3.0))(0), 9.0, 0.2);
  }
}

TEST(RangeGuard, NothingIsChosenWithoutHeldOutRows) {
  const Percentages data = percentages(300, 6);
  llmt::FitOptions without_folds = options();
  without_folds.folds.count = 0;
  const llmt::FitResult result = llmt::fit(data.x, data.y, without_folds);
  EXPECT_TRUE(result.summary.partitions[0].range_guards.empty());
  EXPECT_EQ(result.model.partitions()[0].output_range.size(), 0);
}

TEST(RangeGuard, TheModelIsTheSameWithoutIntervalsAndOnAnyThreads) {
  const Percentages data = percentages(500, 7);
  llmt::FitOptions other = options();
  other.intervals = false;
  other.max_threads = 1;
  const llmt::FitResult without = llmt::fit(data.x, data.y, other);
  EXPECT_TRUE(without.intervals.empty());
  EXPECT_TRUE(without.summary.partitions[0].range_guards[0].taken);
  EXPECT_EQ(to_json(without.model), to_json(llmt::fit(data.x, data.y, options()).model));
}

TEST(RangeGuard, EveryOutputHasItsOwn) {
  const Eigen::MatrixXd x = oracle::uniform(600, 3, 8);
  Eigen::MatrixXd y(600, 2);
  y << noisy_plane(x), 50.0 * cut_off(x);
  for (const bool shared : {false, true}) {
    llmt::FitOptions of_both = options();
    of_both.shared_partition = shared;
    const llmt::FitResult result = llmt::fit(x, y, of_both);
    std::vector<llmt::RangeGuard> guards;
    for (const llmt::PartitionSummary& summary : result.summary.partitions) {
      guards.insert(guards.end(), summary.range_guards.begin(), summary.range_guards.end());
    }
    ASSERT_EQ(guards.size(), 2U);
    EXPECT_FALSE(guards[0].taken);
    EXPECT_TRUE(guards[1].taken);
    EXPECT_EQ(result.model.partitions().back().output_range.bottomRows(1), Eigen::RowVector2d(-50.0, 50.0));
    if (!shared) continue;
    EXPECT_EQ(result.model.partitions()[0].output_range.row(0), Eigen::RowVector2d(-open, open));
    // The errors of a shared partition are in standard deviations of its outputs.
    double squares = 0.0;
    for (int o = 0; o < 2; ++o) {
      const double variance = (y.col(o).array() - y.col(o).mean()).square().mean();
      const double rmse = guards[o].taken ? guards[o].rmse_with : guards[o].rmse_without;
      squares += 0.5 * rmse * rmse / variance;
    }
    EXPECT_NEAR(result.summary.partitions[0].chosen.rmse, std::sqrt(squares), 1e-12);
  }
}

TEST(RangeGuard, RowsThatTakeNoPartDoNotWidenTheRange) {
  const Eigen::MatrixXd x = oracle::uniform(600, 3, 9);
  Eigen::VectorXd y = cut_off(x);
  for (const int row : {40, 140, 240, 340}) y(row) = 60.0;
  llmt::FitOptions robust = options();
  robust.loss = llmt::Loss::tukey;
  const Eigen::VectorXd weights = (y.array() > 1.0).select(0.0, Eigen::VectorXd::Ones(600));
  for (const llmt::FitResult& result :
       {llmt::fit(x, y, robust), llmt::fit({.inputs = x, .outputs = y, .weights = weights}, options())}) {
    EXPECT_TRUE(result.summary.partitions[0].range_guards[0].taken);
    EXPECT_EQ(result.model.partitions()[0].output_range, Eigen::RowVector2d(-1.0, 1.0));
  }
}

TEST(RangeGuard, ASingleHoldOutDecidesToo) {
  const Eigen::MatrixXd x = oracle::uniform(50000, 2, 10);
  llmt::FitOptions few = options();
  few.max_leaves = 6;
  few.min_leaf_samples = 2000;
  few.validity = llmt::ValidityChoice::crisp;
  for (const bool bounded : {true, false}) {
    const llmt::FitResult result = llmt::fit(x, bounded ? cut_off(x) : noisy_plane(x), few);
    ASSERT_EQ(result.summary.partitions[0].cv_folds, 1);
    const llmt::RangeGuard& guard = result.summary.partitions[0].range_guards[0];
    EXPECT_EQ(guard.taken, bounded) << guard.rmse_without << " " << guard.rmse_with;
    EXPECT_NEAR(result.summary.partitions[0].chosen.rmse, bounded ? guard.rmse_with : guard.rmse_without, 1e-12);
  }
}

}  // namespace
