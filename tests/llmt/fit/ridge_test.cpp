// One linear model that is drawn to the mean where held-out rows want it.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <cstdint>

#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"

namespace {

using oracle::Sample;

// Many inputs, each of which matters a little.
Sample weak(Eigen::Index rows, Eigen::Index inputs, std::uint64_t seed) {
  llmt::Random random(seed);
  Sample data{oracle::uniform(rows, inputs, seed + 100), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) data.y(i, 0) = data.x.row(i).sum() + 3.0 * random.normal();
  return data;
}

TEST(Ridge, EqualsItsNormalEquations) {
  const Sample data = weak(60, 15, 3);
  const llmt::FitOptions options{.choose_inputs = false, .validity = llmt::ValidityChoice::crisp};
  const llmt::FitResult result = llmt::fit(data.x, data.y, options);
  const llmt::Candidate& chosen = result.summary.partitions[0].chosen.candidate;
  ASSERT_EQ(chosen.leaves, 1);
  ASSERT_GT(chosen.shrinkage, 0.0);
  const Eigen::MatrixXd centred = data.x.rowwise() - data.x.colwise().mean();
  const Eigen::VectorXd variance = centred.cwiseAbs2().colwise().mean();
  Eigen::MatrixXd gram = centred.transpose() * centred;
  gram.diagonal() += (chosen.shrinkage + 1e-6) * variance;
  const Eigen::VectorXd slopes =
      gram.partialPivLu().solve(centred.transpose() * (data.y.array() - data.y.mean()).matrix());
  const llmt::Node& root = result.model.partitions()[0].nodes[0];
  EXPECT_LT((root.slope.row(0).transpose() - slopes).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_NEAR(root.value(0), data.y.mean(), 1e-8);
}

TEST(Ridge, PredictsBetterThanLeastSquaresWhereRowsAreFew) {
  double with = 0.0;
  double without = 0.0;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    const Sample train = weak(40, 20, seed);
    const Sample test = weak(1000, 20, seed + 50);
    const auto error = [&](const llmt::FitOptions& options) {
      return llmt::rmse(llmt::fit(train.x, train.y, options).model.predict(test.x), test.y)(0);
    };
    with += error({.choose_inputs = false});
    without += error({.max_leaves = 1});
  }
  EXPECT_LT(with, 0.93 * without);
}

TEST(Ridge, LeastSquaresStaysWhereRowsAreMany) {
  llmt::Random random(1);
  const Eigen::MatrixXd x = oracle::uniform(500, 4, 1);
  Eigen::MatrixXd y(500, 1);
  for (Eigen::Index i = 0; i < 500; ++i) y(i, 0) = x.row(i).sum() + 0.1 * random.normal();
  const llmt::PartitionSummary summary = llmt::fit(x, y).summary.partitions[0];
  EXPECT_EQ(summary.chosen.candidate.leaves, 1);
  EXPECT_EQ(summary.chosen.candidate.shrinkage, 0.0);
}

}  // namespace
