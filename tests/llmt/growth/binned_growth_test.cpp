#include <gtest/gtest.h>

#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"

namespace {

using oracle::nodes;

llmt::FitResult grow(const llmt::TrainingData& data, llmt::SplitSearch search, Eigen::Index max_leaves,
                     llmt::FitOptions options = {}) {
  options.significance = llmt::every_split;
  options.max_leaves = max_leaves;
  options.expert.search = search;
  options.validity = llmt::ValidityChoice::crisp;
  options.folds.count = 0;
  return llmt::fit(data, options);
}

llmt::FitResult grow(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, llmt::SplitSearch search,
                     Eigen::Index max_leaves, const llmt::FitOptions& options = {}) {
  return grow(llmt::TrainingData{x, y}, search, max_leaves, options);
}

double rss(const std::vector<llmt::Node>& tree) {
  double sum = 0.0;
  for (const llmt::Node& node : tree) {
    sum += node.is_leaf() ? node.rss.sum() : 0.0;
  }
  return sum;
}

void expect_same_tree(const std::vector<llmt::Node>& a, const std::vector<llmt::Node>& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  const double scale = a[0].rss.sum();
  for (std::size_t i = 0; i < a.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(a[i].split_input, b[i].split_input);
    EXPECT_NEAR(a[i].threshold, b[i].threshold, 1e-9);
    EXPECT_EQ(a[i].level_side, b[i].level_side);
    EXPECT_EQ(a[i].samples, b[i].samples);
    EXPECT_EQ(a[i].rank, b[i].rank);
    EXPECT_LT((a[i].rss - b[i].rss).cwiseAbs().maxCoeff(), tolerance * scale);
    EXPECT_LT((a[i].value - b[i].value).norm(), 1e-8);
    EXPECT_LT((a[i].slope - b[i].slope).norm(), 1e-8);
  }
}

// Inputs of so few values that every one has a bin of its own.
Eigen::MatrixXd grid(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  return (oracle::uniform(rows, columns, seed) * 32.0).array().round() / 32.0;
}

TEST(BinnedGrowth, IsExactWhereEveryValueHasABin) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const Eigen::MatrixXd x = grid(9000, 3, seed);
    const Eigen::MatrixXd y = oracle::curved(x, 0.1, seed);
    const llmt::FitResult binned = grow(x, y, llmt::SplitSearch::binned, 12);
    EXPECT_GT(binned.summary.partitions[0].search.binned_nodes, 4);
    EXPECT_EQ(binned.summary.partitions[0].search.largest_excess, 0.0);
    expect_same_tree(nodes(binned), nodes(grow(x, y, llmt::SplitSearch::exact, 12)), 1e-11);
  }
}

TEST(BinnedGrowth, CategoriesWeightsAndSharedOutputsAreThoseOfTheExactSearch) {
  Eigen::MatrixXd x = grid(9000, 4, 7);
  x.col(3) = ((x.col(3).array() + 1.0) * 3.4).floor().cwiseMax(0.0).cwiseMin(6.0);
  Eigen::MatrixXd y(9000, 2);
  y << oracle::curved(x.leftCols(3), 0.1, 7), oracle::curved(x.leftCols(3).rowwise().reverse(), 0.2, 8);
  for (Eigen::Index i = 0; i < 9000; ++i) {
    y.row(i).array() += x(i, 3) == 2.0 || x(i, 3) == 5.0 ? 2.0 * x(i, 0) : 0.0;
  }
  llmt::FitOptions options;
  options.shared_partition = true;
  llmt::TrainingData data{.inputs = x, .outputs = y, .categorical_inputs = {3}};
  data.weights = oracle::uniform(9000, 1, 9).array().abs() + 0.1;
  expect_same_tree(nodes(grow(data, llmt::SplitSearch::binned, 10, options)),
                   nodes(grow(data, llmt::SplitSearch::exact, 10, options)), 1e-11);
}

TEST(BinnedGrowth, ConstantAndCollinearColumnsKeepTheRankAndTheModelOfTheExactSearch) {
  Eigen::MatrixXd x = grid(9000, 5, 11);
  x.col(2) = x.col(0) - 2.0 * x.col(1);
  x.col(3).setConstant(5.0);
  x.col(4) = (x.col(4).array() > 0.0).cast<double>();  // constant in the children of a split on it
  Eigen::MatrixXd y = oracle::curved(x.leftCols(2), 0.1, 11);
  y.array() += 3.0 * x.col(4).array() * x.col(0).array();
  const llmt::FitResult binned = grow(x, y, llmt::SplitSearch::binned, 8);
  const llmt::FitResult exact = grow(x, y, llmt::SplitSearch::exact, 8);
  expect_same_tree(nodes(binned), nodes(exact), 1e-11);
  EXPECT_EQ(nodes(binned)[0].rank, 4);
}

TEST(BinnedGrowth, ExcessIsAtMostWhatTheCertificateSays) {
  int exact_searches = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Eigen::MatrixXd x = oracle::uniform(5000, 3, seed);
    // From a plain kink to pure noise.
    const double noise = seed % 4 == 0 ? 100.0 : 0.1 * static_cast<double>(seed);
    const Eigen::MatrixXd y = oracle::curved(x, noise, seed);
    const llmt::FitResult binned = grow(x, y, llmt::SplitSearch::binned, 2);
    const llmt::FitResult exact = grow(x, y, llmt::SplitSearch::exact, 2);
    const double root = nodes(exact)[0].rss(0);
    const double excess = (rss(nodes(binned)) - rss(nodes(exact))) / root;
    EXPECT_GE(excess, -1e-12);
    EXPECT_LE(excess, binned.summary.partitions[0].search.largest_excess + 1e-12);
    exact_searches += binned.summary.partitions[0].search.largest_excess == 0.0 ? 1 : 0;
  }
  // Bins that may hold a better split are searched exactly, unless they are too many, as with noise.
  EXPECT_GT(exact_searches, 5);
  EXPECT_LT(exact_searches, 20);
}

TEST(BinnedGrowth, SmallResidualsKeepTheirDigits) {
  // A target of pieces whose residuals fall by twelve orders of magnitude along the tree.
  Eigen::MatrixXd x = grid(9000, 2, 3);
  Eigen::MatrixXd y(9000, 1);
  for (Eigen::Index i = 0; i < 9000; ++i) {
    const double a = x(i, 0);
    y(i, 0) = (a > 0.01 ? 1.0 + a : -1.0) + 1e-6 * std::abs(x(i, 1) - 0.3) * (a > 0.01 ? 1.0 : 0.0);
  }
  const llmt::FitResult binned = grow(x, y, llmt::SplitSearch::binned, 3);
  ASSERT_EQ(nodes(binned).size(), 5U);
  EXPECT_NEAR(nodes(binned)[0].threshold, 0.0155, 0.0156);
  const llmt::Node& second = nodes(binned)[2];
  EXPECT_EQ(second.split_input, 1);
  EXPECT_NEAR(second.threshold, 0.3, 0.0156);
  EXPECT_LT(rss(nodes(binned)), 1e-10 * second.rss(0));
}

TEST(BinnedGrowth, SameBytesAtAnyNumberOfThreadsAndSameTreeInAnyOrderOfRows) {
  const Eigen::MatrixXd x = oracle::uniform(80000, 4, 5);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1, 5);
  llmt::FitOptions options;
  options.max_threads = 1;
  const llmt::FitResult one = grow(x, y, llmt::SplitSearch::binned, 20, options);
  options.max_threads = 4;
  EXPECT_EQ(to_json(one.model), to_json(grow(x, y, llmt::SplitSearch::binned, 20, options).model));
  expect_same_tree(nodes(one), nodes(grow(x.colwise().reverse(), y.colwise().reverse(), llmt::SplitSearch::binned, 20)),
                   1e-11);
}

TEST(BinnedGrowth, TreeIsAboutAsGoodAsTheExactOne) {
  const Eigen::MatrixXd x = oracle::uniform(60000, 4, 6);
  const Eigen::MatrixXd y = oracle::curved(x, 0.05, 6);
  const double binned = rss(nodes(grow(x, y, llmt::SplitSearch::binned, 15)));
  const double exact = rss(nodes(grow(x, y, llmt::SplitSearch::exact, 15)));
  EXPECT_LT(binned, 1.01 * exact);
}

TEST(BinnedGrowth, DataThatCannotBeBinnedAreSearchedExactly) {
  Eigen::MatrixXd x = oracle::uniform(3000, 2, 8);
  x(17, 1) = std::nan("");
  const llmt::FitResult result = grow(x, oracle::uniform(3000, 1, 9), llmt::SplitSearch::binned, 4);
  EXPECT_EQ(result.summary.partitions[0].search.binned_nodes, 0);
  EXPECT_GT(result.summary.partitions[0].search.exact_nodes, 0);
}

}  // namespace
