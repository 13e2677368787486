#include <gtest/gtest.h>

#include <numeric>

#include "growth/best_first/best_first.hpp"
#include "growth/search/split_search.hpp"
#include "llmt/fit.hpp"
#include "numerics/f_distribution.hpp"
#include "oracles/oracles.hpp"

namespace {

// Two leaves, no test of whether the split is worth it, as grown.
std::vector<llmt::Node> one_split(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, Eigen::Index min_leaf) {
  std::vector<int> inputs(x.cols());
  std::iota(inputs.begin(), inputs.end(), 0);
  const llmt::Table table{x, y, Eigen::VectorXd::Ones(x.rows()), std::vector<int>(inputs.size(), 0), inputs, inputs};
  std::vector<int> rows(x.rows());
  std::iota(rows.begin(), rows.end(), 0);
  const llmt::TrainingRows training = llmt::training_rows(table, rows);
  llmt::GrowthProblem problem{&training, {0}, {}, 0};
  problem.options = {.significance = llmt::every_split, .min_leaf_samples = min_leaf, .max_leaves = 2};
  problem.options.split_inputs = inputs;
  return llmt::grow(problem).nodes;
}

void expect_brute_force_split(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, Eigen::Index min_leaf,
                              double tolerance = 1e-11) {
  const oracle::Split expected = oracle::best_split(x, y, min_leaf, llmt::tie_tolerance);
  const std::vector<llmt::Node> nodes = one_split(x, y, min_leaf);
  const llmt::Node& root = nodes[0];
  ASSERT_EQ(root.split_input, expected.input);
  if (expected.input < 0) return;
  EXPECT_GE(root.threshold, expected.low);
  EXPECT_LT(root.threshold, expected.high);
  EXPECT_NEAR(nodes[1].rss(0) + nodes[2].rss(0), static_cast<double>(expected.rss), tolerance * root.rss(0));
}

TEST(SplitSearch, BestSplitEqualsBruteForceRefit) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    const Eigen::Index columns = 1 + seed % 4;
    const Eigen::MatrixXd x = oracle::uniform(60, std::max<Eigen::Index>(columns, 2), seed);
    expect_brute_force_split(x, oracle::curved(x, 0.1, seed), 3 + seed % 5);
  }
}

TEST(SplitSearch, BestSplitEqualsBruteForceRefitForManyInputs) {
  const Eigen::MatrixXd x = oracle::uniform(120, 11, 3);
  expect_brute_force_split(x, oracle::curved(x, 0.05), 15);
}

TEST(SplitSearch, BestSplitEqualsBruteForceRefitWithTiesConstantsAndDuplicates) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    Eigen::MatrixXd x(50, 5);
    x << (oracle::uniform(50, 3, seed) * 3.0).array().round().matrix(), Eigen::VectorXd::Constant(50, 4.0),
        Eigen::VectorXd::Zero(50);
    x.col(4) = x.col(0);
    expect_brute_force_split(x, oracle::curved(x, 0.1, seed), 4);
  }
}

TEST(SplitSearch, BestSplitEqualsBruteForceRefitForNearlyCollinearInputs) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    Eigen::MatrixXd x = oracle::uniform(60, 3, seed);
    x.col(2) = x.col(0) + 1e-5 * x.col(2);
    expect_brute_force_split(x, oracle::curved(x, 1e-3, seed), 5);
  }
}

TEST(SplitSearch, NoAdmissibleSplitGivesOneLeaf) {
  const Eigen::MatrixXd x = Eigen::MatrixXd::Constant(20, 2, 3.0);
  expect_brute_force_split(x, oracle::uniform(20, 1, 1), 2);
  const Eigen::MatrixXd few = oracle::uniform(5, 1, 2);
  expect_brute_force_split(few, oracle::uniform(5, 1, 3), 3);
}

TEST(SplitSearch, KinkIsFoundUnderNoiseOf1e9OfTheTarget) {
  const Eigen::MatrixXd x = oracle::uniform(400, 2, 5);
  llmt::Random random(6);
  Eigen::MatrixXd y(400, 1);
  for (int i = 0; i < 400; ++i) {
    y(i, 0) = 2.0 * x(i, 0) - x(i, 1) + 1e-7 * std::max(0.0, x(i, 0) - 0.25) + 1e-9 * random.normal();
  }
  // Rounding of the target itself is 2e-16, that is 2e-7 of the noise, and cannot be undone: the bound is that on the
  // noise's share of the sum of squares, 2 * 2e-7, which is about 0.6 % of the root's.
  expect_brute_force_split(x, y, 6, 4e-7 * 0.006);
}

TEST(FDistribution, SurvivalMatchesTabulatedQuantiles) {
  // Upper 5 %, 1 % and 0.1 % points from standard tables, degrees of freedom of numerator and denominator in this
  // order.
  EXPECT_NEAR(llmt::f_survival(3.7083, 3, 10), 0.05, 2e-6);
  EXPECT_NEAR(llmt::f_survival(4.1027, 5, 20), 0.01, 2e-6);
  EXPECT_NEAR(llmt::f_survival(161.4476, 1, 1), 0.05, 1e-8);
  EXPECT_NEAR(llmt::f_survival(12.5527, 3, 10) / 0.001, 1.0, 1e-4);
  EXPECT_GT(llmt::f_survival(3.7083, 10, 3), 0.15);  // swapped, it is another number: 8.79 is the 5 % point
  EXPECT_NEAR(llmt::f_survival(8.7855, 10, 3), 0.05, 2e-6);
}

TEST(FDistribution, QuantileIsTheInverseOfSurvival) {
  for (const double d1 : {1.0, 3.0, 11.0}) {
    for (const double d2 : {4.0, 30.0, 1e3, 1e7}) {
      for (const double f : {0.3, 1.0, 4.0, 9.0}) {
        EXPECT_NEAR(llmt::f_quantile(llmt::f_survival(f, d1, d2), d1, d2) / f, 1.0, 1e-8);
      }
    }
  }
}

TEST(FDistribution, SurvivalHasItsLimits) {
  EXPECT_EQ(llmt::f_survival(0.0, 3, 10), 1.0);
  EXPECT_EQ(llmt::f_survival(std::numeric_limits<double>::infinity(), 3, 10), 0.0);
  EXPECT_EQ(llmt::f_survival(1e300, 11, 100000), 0.0);
  // d1 = 2: (1 + 2 f / d2)^(-d2 / 2), in closed form.
  for (const double f : {0.1, 1.0, 5.0, 80.0}) {
    EXPECT_NEAR(llmt::f_survival(f, 2, 30) / std::pow(1.0 + 2.0 * f / 30.0, -15.0), 1.0, 1e-12);
  }
}

}  // namespace
