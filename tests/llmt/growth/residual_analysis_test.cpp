#include <gtest/gtest.h>

#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <vector>

#include "growth/best_first/residual_search.hpp"
#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"
#include "oracles/samples.hpp"

namespace {

using oracle::nodes;

using llmt::ResidualStatistics;

ResidualStatistics statistics(const Eigen::VectorXd& x, const Eigen::VectorXd& residuals,
                              const Eigen::VectorXd& weights) {
  const auto span = [](const Eigen::VectorXd& values) { return std::span(values.data(), values.size()); };
  return llmt::residual_statistics(span(x), span(residuals), span(weights));
}

// Student's two-sample statistic as in a textbook, rows of weight w as w rows.
long double student(const std::vector<double>& a, const std::vector<double>& b, const std::vector<double>& weight_a,
                    const std::vector<double>& weight_b) {
  const auto moments = [](const std::vector<double>& x, const std::vector<double>& w) {
    long double n = 0.0L;
    long double mean = 0.0L;
    long double squares = 0.0L;
    for (std::size_t i = 0; i < x.size(); ++i) {
      n += w[i];
      mean += static_cast<long double>(w[i]) * x[i];
    }
    mean /= n;
    for (std::size_t i = 0; i < x.size(); ++i) {
      squares += w[i] * (x[i] - mean) * (x[i] - mean);
    }
    return std::array<long double, 3>{n, mean, squares};
  };
  const auto [n_a, mean_a, squares_a] = moments(a, weight_a);
  const auto [n_b, mean_b, squares_b] = moments(b, weight_b);
  const long double variance = (squares_a + squares_b) / (n_a + n_b - 2.0L);
  return (mean_a - mean_b) / std::sqrt(variance * (1.0L / n_a + 1.0L / n_b));
}

llmt::FitResult grow_ra(const llmt::TrainingData& data, llmt::FitOptions options = {}) {
  options.rule = llmt::GrowthRule::ra;
  options.validity = llmt::ValidityChoice::crisp;
  options.folds.count = 0;
  return llmt::fit(data, options);
}

llmt::FitResult grow_ra(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const llmt::FitOptions& options = {}) {
  return grow_ra(llmt::TrainingData{x, y}, options);
}

TEST(ResidualAnalysis, StatisticsAreThoseOfATextbook) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Eigen::Index rows = 7 + 13 * seed;
    Eigen::VectorXd x = 1e6 + oracle::uniform(rows, 1, seed).col(0).array().cube();
    const Eigen::VectorXd residuals = oracle::uniform(rows, 1, seed + 100).col(0) + 1e-1 * (x.array() - 1e6).matrix();
    Eigen::VectorXd weights = oracle::uniform(rows, 1, seed + 200).col(0).array().abs() + 0.2;
    if (seed % 2 == 0) {
      weights.setOnes();
    }
    x(3) = std::nan("");
    std::array<std::vector<double>, 2> of_class;
    std::array<std::vector<double>, 2> weight;
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (!std::isnan(x(i))) {
        of_class[residuals(i) >= 0.0 ? 0 : 1].push_back(x(i));
        weight[residuals(i) >= 0.0 ? 0 : 1].push_back(weights(i));
      }
    }
    std::array<std::vector<double>, 2> distance;
    std::array<double, 2> mean{};
    for (std::size_t c = 0; c < 2; ++c) {
      long double sum = 0.0L;
      long double total = 0.0L;
      for (std::size_t i = 0; i < of_class[c].size(); ++i) {
        sum += static_cast<long double>(weight[c][i]) * of_class[c][i];
        total += weight[c][i];
      }
      mean[c] = static_cast<double>(sum / total);
      for (const double value : of_class[c]) {
        distance[c].push_back(static_cast<double>(std::abs(value - sum / total)));
      }
    }
    const ResidualStatistics found = statistics(x, residuals, weights);
    EXPECT_NEAR(found.positive_mean, mean[0], 1e-9);
    EXPECT_NEAR(found.negative_mean, mean[1], 1e-9);
    EXPECT_NEAR(found.means, static_cast<double>(student(of_class[0], of_class[1], weight[0], weight[1])), 1e-7);
    EXPECT_NEAR(found.variances, static_cast<double>(student(distance[0], distance[1], weight[0], weight[1])), 1e-7);
    EXPECT_NEAR(found.freedom, weights.sum() - weights(3) - 2.0, 1e-10 * static_cast<double>(rows));
  }
}

TEST(ResidualAnalysis, DeviatesAreThoseOfTheSameProbability) {
  const boost::math::normal normal;
  for (const double freedom : {5.0, 20.0, 100.0, 1e4}) {
    const boost::math::students_t distribution(freedom);
    for (const double t : {0.1, 1.0, 2.0, 4.0, 7.0}) {
      const ResidualStatistics each{.means = 0.5 * t, .variances = -t, .freedom = freedom};
      const double p = boost::math::cdf(boost::math::complement(distribution, t));
      const double deviate = boost::math::quantile(boost::math::complement(normal, p));
      EXPECT_NEAR(each.deviate(), deviate, 0.01 * deviate);
    }
  }
}

TEST(ResidualAnalysis, ComparesInputsWhereProbabilitiesUnderflow) {
  const ResidualStatistics less{.means = 60.0, .variances = 0.0, .freedom = 1e6};
  const ResidualStatistics more{.means = 60.1, .variances = 0.0, .freedom = 1e6};
  EXPECT_EQ(boost::math::cdf(boost::math::complement(boost::math::students_t(1e6), 60.0)), 0.0);
  EXPECT_LT(less.deviate(), more.deviate());
}

TEST(ResidualAnalysis, ConstantInputsAndEmptyClassesTellNothingAndPureClassesEverything) {
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(10);
  const Eigen::VectorXd residuals = (Eigen::VectorXd(10) << 1, -1, 1, -1, 1, -1, 1, -1, 1, -1).finished();
  EXPECT_EQ(statistics(3e8 * ones, residuals, ones).deviate(), 0.0);
  EXPECT_EQ(statistics(residuals, ones, ones).deviate(), 0.0);
  EXPECT_EQ(statistics(Eigen::VectorXd::Constant(10, std::nan("")), residuals, ones).deviate(), 0.0);
  EXPECT_TRUE(std::isinf(statistics(1e6 + residuals.array(), residuals, ones).means));
}

// Input that the root of a tree of y is split on.
int first_input(const Eigen::MatrixXd& x, const Eigen::VectorXd& y, double* threshold = nullptr) {
  const llmt::FitResult result = grow_ra(x, y);
  if (threshold != nullptr) {
    *threshold = nodes(result)[0].threshold;
  }
  return nodes(result)[0].split_input;
}

TEST(ResidualAnalysis, FindsTheInputThatMatters) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Eigen::MatrixXd x = oracle::uniform(800, 5, seed);
    const Eigen::VectorXd noise = 0.1 * oracle::uniform(800, 1, seed + 50).col(0);
    const Eigen::VectorXd line = x.col(4);
    double threshold = 0.0;
    EXPECT_EQ(first_input(x, x.col(2).cwiseAbs() + line + noise, &threshold), 2);  // by variances
    EXPECT_NEAR(threshold, 0.0, 0.1);
    EXPECT_EQ(first_input(x, x.col(1).cwiseAbs2() - line + noise, &threshold), 1);
    EXPECT_NEAR(threshold, 0.0, 0.1);
    // By means: a kink far from the middle.
    EXPECT_EQ(first_input(x, (3.0 * x.col(3)).array().exp().matrix() + line + noise), 3);
  }
}

TEST(ResidualAnalysis, ProductsOfInputsAreFoundThoughSignsTellNothing) {
  const Eigen::MatrixXd x = oracle::uniform(2500, 4, 3);
  const int input = first_input(x, x.col(1).cwiseProduct(x.col(3)) + 0.05 * oracle::uniform(2500, 1, 4).col(0));
  EXPECT_TRUE(input == 1 || input == 3) << input;
}

TEST(ResidualAnalysis, PureNoiseIsRarelySplit) {
  int split = 0;
  constexpr int trees = 200;
  for (std::uint64_t seed = 1; seed <= trees; ++seed) {
    llmt::Random random(seed);
    Eigen::VectorXd y(120);
    for (double& value : y) {
      value = random.normal();
    }
    split += nodes(grow_ra(oracle::uniform(120, 3, seed + 1000), y)).size() > 1 ? 1 : 0;
  }
  // At most 5 %: Binomial(200, 0.05) is above 22 in less than 1 of 2000 cases.
  EXPECT_LE(split, 22);
}

TEST(ResidualAnalysis, CostOfANodeDoesNotDependOnItsRows) {
  for (const Eigen::Index rows : {1000, 10000, 40000}) {
    SCOPED_TRACE(rows);
    llmt::FitOptions options;
    options.max_leaves = 6;
    const Eigen::MatrixXd x = oracle::uniform(rows, 3, 5);
    const llmt::FitResult result = grow_ra(x, oracle::curved(x, 0.1, 5), options);
    ASSERT_EQ(nodes(result).size(), 11U);
    // A sum of squares costs a pass over the rows: at most one for each input.
    EXPECT_LE(result.summary.partitions[0].search.evaluations, 11 * 3);
  }
}

TEST(ResidualAnalysis, ThresholdsThatLeaveTooFewRowsGiveWayToTheNextInput) {
  // The first input has one far outlier on either side of nothing: its class means lie next to it.
  Eigen::MatrixXd x = oracle::uniform(300, 2, 9);
  Eigen::VectorXd y = x.col(1).cwiseAbs();
  x.col(0) = x.col(0) * 1e-6;
  for (Eigen::Index i = 0; i < 3; ++i) {
    x(i, 0) = 50.0;
    y(i) = 5.0;
  }
  const llmt::FitResult result = grow_ra(x, y);
  ASSERT_GT(nodes(result).size(), 1U);
  for (const llmt::Node& node : nodes(result)) {
    EXPECT_GE(node.samples, result.summary.min_leaf_samples);
  }
}

TEST(ResidualAnalysis, LargeAndSmallNodesSplitAlike) {
  // Large nodes work with Gram matrices in the root's basis, small ones and data with missing values with features of
  // their own: a column of one missing value that is never used makes the difference.
  const Eigen::MatrixXd x = oracle::uniform(4000, 3, 11);
  const Eigen::MatrixXd y = oracle::curved(x, 0.1, 11);
  Eigen::MatrixXd wider(4000, 4);
  wider << x, Eigen::VectorXd::Constant(4000, std::nan(""));
  llmt::FitOptions options;
  options.max_leaves = 8;
  options.regression_inputs = {0, 1, 2};
  const llmt::FitResult large = grow_ra(x, y, options);
  const llmt::FitResult own = grow_ra(wider, y, options);
  ASSERT_EQ(nodes(large).size(), nodes(own).size());
  for (std::size_t i = 0; i < nodes(large).size(); ++i) {
    EXPECT_EQ(nodes(large)[i].split_input, nodes(own)[i].split_input);
    EXPECT_NEAR(nodes(large)[i].threshold, nodes(own)[i].threshold, 1e-9);
    EXPECT_LT((nodes(large)[i].slope - nodes(own)[i].slope).norm(), 1e-8);
  }
}

TEST(ResidualAnalysis, SameBytesAtAnyNumberOfThreadsAndSameTreeInAnyOrderOfRows) {
  const Eigen::MatrixXd x = oracle::coarse(oracle::uniform(20000, 4, 5));
  Eigen::MatrixXd y(20000, 2);
  y << oracle::curved(x, 0.1, 5), oracle::curved(x.rowwise().reverse(), 0.1, 6);
  for (const bool shared : {false, true}) {
    llmt::FitOptions options;
    options.shared_partition = shared;
    options.max_leaves = 20;
    options.max_threads = 1;
    const llmt::FitResult one = grow_ra(x, y, options);
    options.max_threads = 4;
    EXPECT_EQ(to_json(one.model), to_json(grow_ra(x, y, options).model));
    const llmt::FitResult reversed = grow_ra(x.colwise().reverse(), y.colwise().reverse(), options);
    ASSERT_EQ(nodes(one).size(), nodes(reversed).size());
    for (std::size_t i = 0; i < nodes(one).size(); ++i) {
      EXPECT_EQ(nodes(one)[i].split_input, nodes(reversed)[i].split_input);
      EXPECT_EQ(nodes(one)[i].samples, nodes(reversed)[i].samples);
    }
  }
}

TEST(ResidualAnalysis, OffsetsAndScalesDoNotChangeTheTree) {
  const Eigen::MatrixXd x = oracle::coarse(oracle::uniform(3000, 3, 15));
  const Eigen::MatrixXd y = oracle::coarse(oracle::curved(x, 0.1, 15));
  const llmt::FitResult plain = grow_ra(x, y);
  Eigen::MatrixXd moved = x;
  moved.col(0).array() += 1e6;
  moved.col(1) *= 0x1p-30;
  const llmt::FitResult other = grow_ra(moved, (y.array() * 0x1p-20).matrix());
  ASSERT_EQ(nodes(plain).size(), nodes(other).size());
  for (std::size_t i = 0; i < nodes(plain).size(); ++i) {
    EXPECT_EQ(nodes(plain)[i].split_input, nodes(other)[i].split_input);
    EXPECT_EQ(nodes(plain)[i].samples, nodes(other)[i].samples);
  }
}

TEST(ResidualAnalysis, CategoriesMissingValuesAndWeightsAreFollowed) {
  for (const Eigen::Index rows : {900, 6000}) {  // small and large nodes
    SCOPED_TRACE(rows);
    Eigen::MatrixXd x = oracle::firm(oracle::uniform(rows, 3, 21));
    x.col(2) = ((x.col(2).array() + 1.0) * 2.5).floor().cwiseMin(4.0);
    Eigen::VectorXd y(rows);
    for (Eigen::Index i = 0; i < rows; ++i) {
      y(i) = (x(i, 2) == 1.0 || x(i, 2) == 3.0 ? 4.0 : -4.0) * x(i, 0);
    }
    const llmt::FitResult by_levels = grow_ra({.inputs = x, .outputs = y, .categorical_inputs = {2}});
    EXPECT_EQ(nodes(by_levels)[0].split_input, 2);
    EXPECT_EQ(nodes(by_levels)[0].level_side[1], nodes(by_levels)[0].level_side[3]);
    EXPECT_LT(by_levels.summary.partitions[0].train_rmse(0), 1e-9);

    // Rows without a value: a group of their own. Rows of weight 0 take no part.
    Eigen::MatrixXd gappy = x.leftCols(2);
    Eigen::VectorXd z = gappy.col(0);
    Eigen::VectorXd weights = Eigen::VectorXd::Ones(rows);
    for (Eigen::Index i = 0; i < rows; i += 3) {
      gappy(i, 1) = std::nan("");
      z(i) += 7.0;
    }
    for (Eigen::Index i = 1; i < rows; i += 3) {
      weights(i) = 0.0;
      z(i) = 1e3;
    }
    const llmt::FitResult by_missing = grow_ra({.inputs = gappy, .outputs = z, .weights = weights});
    EXPECT_EQ(nodes(by_missing)[0].split_input, 1);
    EXPECT_EQ(nodes(by_missing)[0].threshold, std::numeric_limits<double>::max());
    EXPECT_LT(by_missing.summary.partitions[0].train_rmse(0), 1e-9);
  }
}

TEST(ResidualAnalysis, PrefixesAreNestedAndBlendsAreChosenAsForAnyRule) {
  const Eigen::MatrixXd x = oracle::uniform(600, 2, 31);
  const Eigen::MatrixXd y = oracle::curved(x, 0.05, 31);
  llmt::FitOptions options;
  options.rule = llmt::GrowthRule::ra;
  const llmt::FitResult result = llmt::fit(x, y, options);
  const llmt::PartitionSummary& summary = result.summary.partitions[0];
  EXPECT_EQ(summary.chosen.candidate.validity.kind, llmt::ValidityKind::blend);
  EXPECT_LT(summary.chosen.rmse, 0.5 * summary.best_of_kind[0].rmse);
  EXPECT_FALSE(result.intervals.models().empty());
  EXPECT_EQ(to_json(llmt::from_json(to_json(result.model))), to_json(result.model));
}

}  // namespace
