#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "growth/search/split_search.hpp"
#include "oracles/brute_force_search.hpp"
#include "oracles/oracles.hpp"

namespace {

// A node with a sorted list of rows for every input; NaN: no value.
struct Problem {
  llmt::Features features;
  Eigen::VectorXd weights;
  double rss = 0.0;
  std::vector<std::vector<int>> orders;
  std::vector<std::vector<double>> values;

  double weight = 0.0;

  llmt::SearchNode node() const { return {features, weights, rss, weight, static_cast<int>(features.coefficients())}; }
};

using Wide = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

// The part of `column` that is orthogonal to the orthonormal columns of `basis`.
Wide orthogonal_part(const Wide& basis, Wide column) {
  for (int pass = 0; pass < 2; ++pass) {  // the second pass takes out the rounding of the first
    column -= basis * (basis.transpose() * column);
  }
  return column;
}

// [1, x] times the roots of the weights, made orthonormal by Gram and Schmidt in long double. A column of which less
// than 1e-10 is left depends on the columns before it and is dropped.
Wide orthonormal(const Eigen::MatrixXd& x, const Eigen::VectorXd& weights) {
  Wide design(x.rows(), x.cols() + 1);
  design << Wide::Ones(x.rows(), 1), x.cast<long double>();
  design = weights.cast<long double>().cwiseSqrt().asDiagonal() * design;
  Wide basis(x.rows(), 0);
  for (Eigen::Index k = 0; k < design.cols(); ++k) {
    const Wide rest = orthogonal_part(basis, design.col(k));
    if (rest.norm() <= 1e-10L * design.col(k).norm()) continue;
    basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
    basis.rightCols(1) = rest.normalized();
  }
  return basis;
}

Problem make_problem(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Eigen::VectorXd& weights,
                     Eigen::Index regressors) {
  Problem problem;
  const Eigen::MatrixXd known = x.array().isNaN().select(0.0, x);
  const Wide basis = orthonormal(known.leftCols(regressors), weights);
  const Wide weighted = weights.cast<long double>().cwiseSqrt().asDiagonal() * y.cast<long double>();
  const Eigen::MatrixXd residuals = orthogonal_part(basis, weighted).cast<double>();
  const Eigen::MatrixXd columns = (basis * std::sqrt(weights.sum())).cast<double>();  // mean square 1 by weight
  problem.weights = Eigen::VectorXd::Constant(y.cols(), 2.0);
  problem.weight = weights.sum();
  problem.rss = problem.weights.dot(residuals.colwise().squaredNorm());
  problem.features = llmt::Features(x.rows(), columns.cols(), y.cols());
  for (Eigen::Index row = 0; row < x.rows(); ++row) {
    Eigen::Map<Eigen::RowVectorXd> features(problem.features.row(row), problem.features.columns());
    features << columns.row(row), residuals.row(row);
  }
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    std::vector<int> order;
    for (int row = 0; row < x.rows(); ++row) {
      if (!std::isnan(x(row, j))) order.push_back(row);
    }
    std::ranges::stable_sort(order, [&](int a, int b) { return x(a, j) < x(b, j); });
    const Eigen::VectorXd sorted = x.col(j)(order);
    problem.values.emplace_back(sorted.begin(), sorted.end());
    problem.orders.push_back(std::move(order));
  }
  return problem;
}

struct Result {
  int input = -1;
  llmt::SplitCandidate split;
  Eigen::Index evaluations = 0;
};

// As growth does it: the inputs share what the edges of their blocks found.
Result search(const Problem& problem, Eigen::Index min_leaf_samples, bool forget = false) {
  std::vector<llmt::InputSearch> searches;
  searches.reserve(problem.orders.size());
  double limit = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < problem.orders.size(); ++j) {
    searches.emplace_back(problem.node(), problem.values[j], problem.orders[j], min_leaf_samples).search_edges();
    limit = std::min(limit, searches.back().smallest());
    if (forget) searches.back().forget_sums();
  }
  double smallest = limit;
  for (llmt::InputSearch& input : searches) {
    input.refine(limit);
    smallest = std::min(smallest, input.smallest());
  }
  Result result;
  for (std::size_t j = 0; j < searches.size(); ++j) {
    const llmt::SplitCandidate split = searches[j].best();
    result.evaluations += split.evaluations;
    if (result.input < 0 && split.input >= 0 && split.adjusted <= smallest + oracle::tie * problem.rss) {
      result.input = static_cast<int>(j);
      result.split = split;
    }
  }
  return result;
}

template <int Coefficients>
void expect_brute_force(const Problem& problem, Eigen::Index min_leaf_samples) {
  ASSERT_EQ(problem.features.coefficients(), Coefficients);
  const oracle::BruteForceSplit expected =
      oracle::search<Coefficients>(problem.node(), problem.orders, problem.values, min_leaf_samples);
  const Result found = search(problem, min_leaf_samples);
  ASSERT_EQ(found.input, expected.input);
  if (expected.input >= 0) {
    EXPECT_EQ(found.split.left, expected.left);
    EXPECT_NEAR(found.split.rss, expected.rss, 1e-11 * problem.rss);
    EXPECT_NEAR(found.split.adjusted, expected.adjusted, 1e-11 * problem.rss);
  }
  // Sums that are formed again are the same sums.
  const Result again = search(problem, min_leaf_samples, true);
  EXPECT_EQ(again.input, found.input);
  EXPECT_EQ(again.split.left, found.split.left);
  EXPECT_EQ(again.split.rss, found.split.rss);
  EXPECT_EQ(again.evaluations, found.evaluations);
}

Eigen::VectorXd ones(Eigen::Index rows) { return Eigen::VectorXd::Ones(rows); }

TEST(ExactSearch, EqualsBruteForceOnCurvedTargets) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const Eigen::MatrixXd x = oracle::uniform(1500, 4, seed);
    expect_brute_force<5>(make_problem(x, oracle::curved(x, 0.2, seed), ones(1500), 4), 10);
  }
}

TEST(ExactSearch, EqualsBruteForceOnPureNoise) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const Eigen::MatrixXd x = oracle::uniform(1500, 4, seed);
    expect_brute_force<5>(make_problem(x, oracle::uniform(1500, 1, seed + 100), ones(1500), 4), 1);
  }
}

TEST(ExactSearch, EqualsBruteForceWithTiesConstantsAndDuplicates) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    for (const double levels : {1.0, 5.0, 40.0, 700.0}) {
      SCOPED_TRACE(seed);
      Eigen::MatrixXd x(1200, 5);
      x << (oracle::uniform(1200, 2, seed) * levels).array().round().matrix(), oracle::uniform(1200, 1, seed + 50),
          Eigen::VectorXd::Constant(1200, 4.0), Eigen::VectorXd::Zero(1200);
      x.col(4) = x.col(2);
      x.bottomRows(300) = x.topRows(300).eval();
      const Eigen::MatrixXd y = oracle::curved(x, 0.1, seed);
      expect_brute_force<4>(make_problem(x, y, ones(1200), 5), 4);
    }
  }
}

TEST(ExactSearch, EqualsBruteForceWithNearlyCollinearInputs) {
  for (const double apart : {1e-2, 1e-5, 1e-8, 1e-12}) {
    SCOPED_TRACE(apart);
    Eigen::MatrixXd x = oracle::uniform(1000, 3, 7);
    x.col(2) = x.col(0) + apart * x.col(2);
    const Problem problem = make_problem(x, oracle::curved(x, 0.05, 7), ones(1000), 3);
    if (apart > 1e-10) {
      expect_brute_force<4>(problem, 5);
    } else {
      expect_brute_force<3>(problem, 5);
    }
  }
}

TEST(ExactSearch, EqualsBruteForceWithWeightsOutputsAndMissingValues) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    Eigen::MatrixXd x = oracle::uniform(1100, 3, seed);
    Eigen::MatrixXd y(1100, 2);
    y << oracle::curved(x, 0.1, seed), oracle::curved(x.rowwise().reverse(), 0.3, seed + 1);
    const Eigen::VectorXd weights = oracle::uniform(1100, 1, seed + 9).array().abs() + 1e-3;
    for (Eigen::Index row = 0; row < 1100; row += 7) {
      x(row, seed % 3) = std::nan("");
    }
    expect_brute_force<4>(make_problem(x, y, weights, 3), 6);
  }
}

TEST(ExactSearch, LeavesMostSplitsAloneWhereThereIsSomethingToFind) {
  const Eigen::MatrixXd x = oracle::uniform(20000, 3, 3);
  const Problem problem = make_problem(x, oracle::curved(x, 0.1, 3), ones(20000), 3);
  expect_brute_force<4>(problem, 8);
  EXPECT_LT(search(problem, 8).evaluations, 60000 / 20);
}

TEST(ExactSearch, NodesOfAnySizeAreSearchedWhole) {
  for (Eigen::Index rows = 2; rows < 200; ++rows) {
    SCOPED_TRACE(rows);
    const Eigen::MatrixXd x = oracle::uniform(rows, 1, 5);
    const Problem problem = make_problem(x, oracle::uniform(rows, 1, 6), ones(rows), 1);
    expect_brute_force<2>(problem, 1);
  }
}

}  // namespace
