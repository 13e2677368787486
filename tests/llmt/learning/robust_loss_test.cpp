// The loss by Tukey's biweight.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "llmt/readable.hpp"
#include "oracles/samples.hpp"

namespace {

using oracle::Sample;

// y = |a| + b, with normal noise of 0.1, ten times as large where a > 0.
Sample sample(Eigen::Index rows, std::uint64_t seed) {
  llmt::Random random(seed);
  Sample s{Eigen::MatrixXd(rows, 2), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    s.x.row(i) << random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0);
    const double noise = s.x(i, 0) > 0.0 ? 1.0 : 0.1;
    s.y(i, 0) = 10.0 * std::abs(s.x(i, 0)) + s.x(i, 1) + noise * random.normal();
  }
  return s;
}

double error(const llmt::Model& model, const Sample& test) { return llmt::rmse(model.predict(test.x), test.y)(0); }

const llmt::FitOptions tukey = {.loss = llmt::Loss::tukey};

TEST(RobustLoss, OnePercentOfTheOutputsAThousandfold) {
  const Sample clean = sample(1000, 1);
  const Sample test = sample(2000, 2);
  Sample wrong = clean;
  for (Eigen::Index i = 0; i < 1000; i += 100) wrong.y(i, 0) *= 1000.0;
  const double base = error(llmt::fit(clean.x, clean.y).model, test);
  EXPECT_GT(error(llmt::fit(wrong.x, wrong.y).model, test), 10.0 * base);
  const llmt::FitResult robust = llmt::fit(wrong.x, wrong.y, tukey);
  EXPECT_LT(error(robust.model, test), 1.02 * base);
  for (Eigen::Index i = 0; i < 1000; i += 100) EXPECT_EQ(robust.summary.loss_weights(i), 0.0) << i;
}

TEST(RobustLoss, ATenthOfTheOutputsWrongOnOneSide) {
  const Sample clean = sample(1000, 1);
  const Sample test = sample(2000, 2);
  Sample wrong = clean;
  for (Eigen::Index i = 0; i < 1000; i += 10) wrong.y(i, 0) += 40.0;
  const double base = error(llmt::fit(clean.x, clean.y).model, test);
  EXPECT_LT(error(llmt::fit(wrong.x, wrong.y, tukey).model, test), 1.05 * base);
}

TEST(RobustLoss, CostsLittleWhereThereIsNothingWrong) {
  const Sample clean = sample(1000, 1);
  const Sample test = sample(2000, 2);
  const double base = error(llmt::fit(clean.x, clean.y).model, test);
  const llmt::FitResult robust = llmt::fit(clean.x, clean.y, tukey);
  EXPECT_LT(error(robust.model, test), 1.02 * base);
  // Noise that is larger on one side is not taken for outliers.
  EXPECT_LT((robust.summary.loss_weights.array() == 0.0).count(), 20);
}

// Rows of small weight count in full among the held-out rows, so that the error is that of new rows.
TEST(RobustLoss, HeldOutErrorIsThatOfNewRows) {
  const auto with_normal_noise = [](Eigen::Index rows, std::uint64_t seed) {
    llmt::Random random(seed);
    Sample s{Eigen::MatrixXd(rows, 2), Eigen::MatrixXd(rows, 1)};
    for (Eigen::Index i = 0; i < rows; ++i) {
      s.x.row(i) << random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0);
      s.y(i, 0) = 10.0 * std::abs(s.x(i, 0)) + s.x(i, 1) + 0.25 * random.normal();
    }
    return s;
  };
  const Sample clean = with_normal_noise(2000, 1);
  Sample wrong = clean;
  wrong.y(100, 0) += 60.0;
  wrong.y(700, 0) -= 50.0;
  wrong.y(1500, 0) += 90.0;
  const Sample test = with_normal_noise(10000, 2);
  for (const Sample* each : {&std::as_const(clean), &std::as_const(wrong)}) {
    const llmt::PreparedFit prepared({each->x, each->y}, tukey);
    const llmt::FitResult robust = llmt::fit(prepared);
    const llmt::PartitionSummary& partition = robust.summary.partitions[0];
    EXPECT_NEAR(partition.chosen.rmse / error(robust.model, test), 1.0, 0.04);
    EXPECT_NEAR(partition.train_rmse(0) / error(robust.model, test), 1.0, 0.05);
    const llmt::ReadableResult readable = llmt::fit_readable(prepared, robust.summary);
    EXPECT_NEAR(readable.partitions[0].rmse / error(readable.model, test), 1.0, 0.04);
  }
}

TEST(RobustLoss, OutputBesideWhichAllOthersAreRoundingErrors) {
  Sample s = sample(300, 1);
  const Sample test = sample(2000, 2);
  const double base = error(llmt::fit(s.x, s.y).model, test);
  s.y(7, 0) = 1e30;
  try {
    llmt::fit(s.x, s.y);
    FAIL() << "it was fitted";
  } catch (const std::invalid_argument& refused) {
    EXPECT_NE(std::string(refused.what()).find("1e+30"), std::string::npos) << refused.what();
  }
  EXPECT_LT(error(llmt::fit(s.x, s.y, tukey).model, test), 1.05 * base);
}

TEST(RobustLoss, WeightsOfTheCallerAreKept) {
  const Sample s = sample(400, 1);
  llmt::TrainingData data{s.x, s.y, Eigen::VectorXd::Ones(400)};
  data.weights.head(100).setZero();
  const llmt::FitResult some = llmt::fit(data, tukey);
  EXPECT_EQ(some.summary.samples, (some.summary.loss_weights.tail(300).array() > 0.0).count());
  EXPECT_TRUE((some.summary.loss_weights.head(100).array() == 0.0).all());
  data.outputs.topRows(100).setConstant(1e6);  // rows that take no part
  const llmt::FitResult same = llmt::fit(data, tukey);
  EXPECT_EQ(llmt::to_json(same.model), llmt::to_json(some.model));
}

TEST(RobustLoss, SeveralOutputsAndMissingInputs) {
  Sample s = sample(600, 1);
  Sample test = sample(1000, 2);
  s.y.conservativeResize(600, 2);
  s.y.col(1) = -s.y.col(0);
  s.y(5, 1) = 1e5;
  for (Eigen::Index i = 0; i < 600; i += 20) s.x(i, 1) = std::nan("");
  const llmt::FitResult robust = llmt::fit(s.x, s.y, tukey);
  EXPECT_EQ(robust.summary.loss_weights(5), 0.0);
  EXPECT_LT(llmt::rmse(robust.model.predict(test.x).leftCols(1), test.y)(0), 1.0);
}

// The preliminary tree is right in most rows, so the spread is 0 and no row is heavy, as docs/algorithms/robust.md
// says: the model is that of least squares.
TEST(RobustLoss, OutputsThatMostlyAgree) {
  Sample s = sample(200, 1);
  s.y.setZero();
  s.y(3, 0) = 5.0;
  llmt::FitOptions plane = tukey;
  plane.max_leaves = 1;
  plane.folds.count = 0;  // no ridge regression is compared
  const llmt::FitResult robust = llmt::fit(s.x, s.y, plane);
  EXPECT_EQ(robust.summary.loss_weights, Eigen::VectorXd::Ones(200));
  Eigen::MatrixXd regressors(200, 3);
  regressors << Eigen::VectorXd::Ones(200), s.x;
  const Eigen::Vector3d expected = regressors.colPivHouseholderQr().solve(s.y);
  const std::vector<llmt::Leaf> leaves = robust.model.leaves(0);
  ASSERT_EQ(leaves.size(), 1U);
  EXPECT_NEAR(leaves[0].intercept(0), expected(0), 1e-12);
  EXPECT_LT((leaves[0].slope.transpose() - expected.tail(2)).norm(), 1e-12);
}

}  // namespace
