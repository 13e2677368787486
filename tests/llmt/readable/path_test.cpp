// The steps of a readable tree: which trees stand on the path, what is said of them, and what they keep.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "llmt/readable.hpp"
#include "readable/path.hpp"

namespace {

struct Waves {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
};

llmt::FitOptions crisp_trees() {
  llmt::FitOptions options;
  options.validity = llmt::ValidityChoice::crisp;
  return options;
}

// A tree as path_of() sees it: its rules and size, and the root mean square errors of two folds of weight 1.
llmt::ComparedTree compared(std::size_t price, Eigen::Index rules, Eigen::Index size, double first, double second,
                            bool has_products = false) {
  const llmt::TreeExtent extent{size, rules, 1};
  return {{0, 0, price}, has_products, {extent, extent, extent}, {first * first, second * second}};
}

TEST(Path, TakesTheSmallestWithinTheLossAndTheShortestOfEveryNumberOfRules) {
  const std::vector<llmt::ComparedTree> trees = {compared(0, 1, 1, 3.0, 3.0),    compared(1, 1, 9, 2.0, 2.0),
                                                 compared(2, 1, 30, 1.99, 1.99), compared(3, 2, 14, 1.3, 1.3),
                                                 compared(4, 2, 40, 1.1, 1.1),   compared(5, 3, 50, 1.2, 1.2),
                                                 compared(6, 4, 60, 1.0, 1.0),   compared(7, 4, 99, 0.99, 0.99)};
  const llmt::PathRule rule{.loss = 0.2, .least = 0.0, .weights = {1.0, 1.0}, .crisp_squares = {}};
  const llmt::Path path = llmt::path_of(trees, rule, -1);
  // 1.2 x 0.99 lets 1.1 pass, not 1.2; of one rule and of four the shorter is within 2 %.
  EXPECT_EQ(path.steps, (std::vector<std::size_t>{1, 4, 5, 6}));
  EXPECT_EQ(path.rules, (std::vector<Eigen::Index>{1, 2, 3, 4}));
  EXPECT_EQ(path.chosen, 1u);
  EXPECT_EQ(path.yardstick, 0.99);
  EXPECT_TRUE(path.is_within_loss);
  EXPECT_EQ(path.with_rules(3), 2u);
  EXPECT_EQ(path.with_rules(400), 3u);
}

TEST(Path, ATreeIsNoWorseThanTheBestSingleEquation) {
  // Within the loss are the small tree of two rules, and short equations; sparse least squares has 1.0.
  const std::vector<llmt::ComparedTree> trees = {compared(0, 1, 9, 1.1, 1.1), compared(1, 1, 21, 1.01, 1.01),
                                                 compared(2, 1, 33, 1.0, 1.0), compared(3, 2, 12, 1.05, 1.05),
                                                 compared(4, 1, 8, 0.9, 0.9, true)};
  llmt::PathRule rule{.loss = 0.5, .least = 0.0, .weights = {1.0, 1.0}, .crisp_squares = {}};
  EXPECT_EQ(llmt::path_of(trees, rule, -1).steps[0], 4u);  // a product may be shorter, and is better
  const std::vector<llmt::ComparedTree> without(trees.begin(), trees.end() - 1);
  const llmt::Path path = llmt::path_of(without, rule, -1);
  EXPECT_EQ(path.steps[path.chosen], 1u);
  // What a crisp tree of the fit reaches, no tree here does: the best is the answer, and it is said.
  rule.crisp_squares = {{0.01, 0.01}};
  const llmt::Path far = llmt::path_of(without, rule, -1);
  EXPECT_FALSE(far.is_within_loss);
  EXPECT_EQ(far.steps[far.chosen], 2u);
}

TEST(Path, ATreeThatIsUnlikeThoseWhoseErrorsAreKnownIsNotTaken) {
  std::vector<llmt::ComparedTree> trees = {compared(0, 1, 1, 9.0, 9.0), compared(1, 2, 20, 1.0, 1.0),
                                           compared(2, 2, 15, 1.0, 1.0), compared(3, 3, 10, 1.0, 1.0)};
  trees[2].extents.back().size = 12;  // shorter than its folds' trees
  trees[3].extents.back().rules = 2;  // with fewer rules
  const llmt::PathRule rule{.loss = 0.1, .least = 0.0, .weights = {1.0, 1.0}, .crisp_squares = {}};
  const llmt::Path path = llmt::path_of(trees, rule, -1);
  EXPECT_EQ(path.steps, (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(path.steps[path.chosen], 1u);
  // For the folds, whose own trees are like the others, they stand.
  EXPECT_EQ(llmt::path_of(trees, rule, 0).steps, (std::vector<std::size_t>{0, 2, 3}));
}

TEST(Path, AFoldDoesNotChooseTheTreeThatItJudges) {
  // The first fold, by chance, likes the short tree: on the second it fails.
  const std::vector<llmt::ComparedTree> trees = {compared(0, 2, 10, 0.5, 1.6), compared(1, 2, 20, 1.0, 1.0),
                                                 compared(2, 1, 9, 5.0, 5.0)};
  const llmt::PathRule rule{.loss = 0.0, .least = 0.0, .weights = {1.0, 1.0}, .crisp_squares = {}};
  const auto chosen = [&](int left_out) {
    const llmt::Path path = llmt::path_of(trees, rule, left_out);
    return path.steps[path.chosen];
  };
  EXPECT_EQ(chosen(0), 1u);
  EXPECT_EQ(chosen(1), 0u);
}

// Waves in x1, so that every rule more pays, and a line in x2.
Waves waves(Eigen::Index rows, std::uint64_t seed = 3) {
  llmt::Random random(seed);
  Waves data{Eigen::MatrixXd(rows, 2), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    data.inputs.row(i) << random.uniform(0.0, 6.0), random.uniform(-1.0, 1.0);
    data.outputs(i, 0) = 3.0 * std::sin(1.5 * data.inputs(i, 0)) + data.inputs(i, 1) + 0.2 * random.normal();
  }
  return data;
}

TEST(Readable, AStepIsTakenByItsRulesAndSaysWhatItCostsOnNewRows) {
  const Waves data = waves(500);
  const llmt::PreparedFit prepared({data.inputs, data.outputs}, crisp_trees());
  const llmt::FitSummary fitted = llmt::fit(prepared).summary;
  const llmt::ReadableResult usual = llmt::fit_readable(prepared, fitted);
  const std::vector<llmt::ReadableStep>& path = usual.partitions[0].path;
  ASSERT_GE(path.size(), 3u);
  for (std::size_t k = 1; k < path.size(); ++k) EXPECT_GT(path[k].leaves, path[k - 1].leaves);
  EXPECT_EQ(path[usual.partitions[0].taken].leaves, usual.partitions[0].leaves);
  EXPECT_EQ(path[usual.partitions[0].taken].size, usual.partitions[0].size);
  const Waves fresh = waves(4000, 4);
  double before = std::numeric_limits<double>::infinity();
  for (const llmt::ReadableStep& step : path) {
    if (step.leaves > 8) break;
    const llmt::ReadableResult taken = llmt::fit_readable(prepared, fitted, {.rules = step.leaves});
    EXPECT_EQ(taken.partitions[0].leaves, step.leaves);
    EXPECT_EQ(taken.partitions[0].size, step.size);
    EXPECT_EQ(taken.partitions[0].rmse, step.rmse);
    const double rmse = std::sqrt((taken.model.predict(fresh.inputs) - fresh.outputs).squaredNorm() / 4000.0);
    // What is said is not too small: 500 rows give a root mean square within 3 % as a rule, and the folds' trees, of
    // 400 rows, are worse. Some folds have a rule less at the same price, so that it may be as large as the error of
    // the step before, but no larger.
    EXPECT_GT(step.rmse / rmse, 0.9) << step.leaves;
    EXPECT_LT(step.rmse, 1.1 * before) << step.leaves;
    if (step.leaves == usual.partitions[0].leaves) EXPECT_LT(step.rmse / rmse, 1.25);
    before = rmse;
  }
  EXPECT_THROW(llmt::fit_readable(prepared, fitted, {.rules = -1}), std::invalid_argument);
}

TEST(Readable, IsNoWorseThanSparseLeastSquaresWhateverTheLoss) {
  llmt::Random random(6);
  const auto draw = [&](Eigen::Index rows) {
    Waves data{Eigen::MatrixXd(rows, 8), Eigen::MatrixXd(rows, 1)};
    for (Eigen::Index i = 0; i < rows; ++i) {
      for (Eigen::Index j = 0; j < 8; ++j) data.inputs(i, j) = random.normal();
      data.outputs(i, 0) = data.inputs.row(i).sum() + 0.5 * random.normal();
    }
    return data;
  };
  const Waves data = draw(300);
  const Waves fresh = draw(3000);
  const llmt::PreparedFit prepared({data.inputs, data.outputs}, crisp_trees());
  const llmt::ReadableResult result = llmt::fit_readable(prepared, llmt::fit(prepared).summary, {.loss = 2.0});
  EXPECT_EQ(result.partitions[0].leaves, 1);
  EXPECT_EQ(result.partitions[0].most_terms, 8);
  const double rmse = std::sqrt((result.model.predict(fresh.inputs) - fresh.outputs).squaredNorm() / 3000.0);
  EXPECT_LT(rmse, 0.55);  // the noise is 0.5
}

TEST(Readable, NoProductStandsWithoutItsMainTerms) {
  llmt::Random random(12);
  Waves data{Eigen::MatrixXd(500, 3), Eigen::MatrixXd(500, 1)};
  for (Eigen::Index i = 0; i < 500; ++i) {
    data.inputs.row(i) << random.uniform(-1.0, 1.0), random.uniform(4.0, 6.0), random.uniform(-1.0, 1.0);
    data.outputs(i, 0) = 3.0 * data.inputs(i, 0) * (data.inputs(i, 1) - 5.0) + 0.05 * random.normal();
  }
  const llmt::PreparedFit prepared({data.inputs, data.outputs}, crisp_trees());
  const llmt::Model model = llmt::fit_readable(prepared, llmt::fit(prepared).summary).model;
  int products = 0;
  for (const llmt::Leaf& leaf : model.leaves(0)) {
    for (std::size_t k = 0; k < model.regressors().size(); ++k) {
      const llmt::Regressor& regressor = model.regressors()[k];
      if (regressor.second_input < 0 || leaf.slope(0, static_cast<Eigen::Index>(k)) == 0.0) continue;
      ++products;
      for (const int input : {regressor.input, regressor.second_input}) {
        double main = 0.0;
        for (std::size_t m = 0; m < model.regressors().size(); ++m) {
          const llmt::Regressor& other = model.regressors()[m];
          if (other.input == input && other.second_input < 0) main = leaf.slope(0, static_cast<Eigen::Index>(m));
        }
        EXPECT_NE(main, 0.0) << k << " " << input;
      }
    }
  }
  EXPECT_GT(products, 0);
}

// Trees with quadratic local models come to the noise; without products a tree of linear ones does not.
TEST(Readable, TheYardstickIsTheErrorOfTheBestCrispTreeOfTheFit) {
  llmt::Random random(13);
  Waves data{Eigen::MatrixXd(300, 2), Eigen::MatrixXd(300, 1)};
  for (Eigen::Index i = 0; i < 300; ++i) {
    data.inputs.row(i) << random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0);
    data.outputs(i, 0) = 3.0 * data.inputs(i, 0) * data.inputs(i, 1) + 0.05 * random.normal();
  }
  llmt::FitOptions options = crisp_trees();
  options.terms = llmt::LocalTerms::quadratic;
  const llmt::PreparedFit prepared({data.inputs, data.outputs}, options);
  const llmt::FitSummary fitted = llmt::fit(prepared).summary;
  const double best = fitted.partitions[0].chosen.rmse;
  EXPECT_LT(best, 0.06);
  EXPECT_NEAR(llmt::fit_readable(prepared, fitted).partitions[0].yardstick, best, 1e-9);
}

TEST(Readable, KeepsTrendsInSlopesAndAtThresholds) {
  // Rises in the first input but for a dip that noise and a second regime invite; a category shifts all.
  llmt::Random random(15);
  Waves data{Eigen::MatrixXd(600, 3), Eigen::MatrixXd(600, 1)};
  for (Eigen::Index i = 0; i < 600; ++i) {
    const double x = random.uniform(0.0, 10.0);
    const double z = random.uniform(-1.0, 1.0);
    const double town = static_cast<double>(i % 3);
    data.inputs.row(i) << x, z, town;
    const double dip = x > 4.0 && x < 5.0 ? -2.0 : 0.0;
    data.outputs(i, 0) =
        (x > 7.0 ? 9.0 + 0.2 * x : 0.8 * x) + dip + z * (town == 1.0 ? 3.0 : -1.0) + 0.3 * random.normal();
  }
  const llmt::TrainingData rows{.inputs = data.inputs, .outputs = data.outputs, .categorical_inputs = {2}};
  const auto largest_fall = [&](const llmt::FitOptions& options, double loss) {
    const llmt::PreparedFit prepared(rows, options);
    const llmt::ReadableResult result = llmt::fit_readable(prepared, llmt::fit(prepared).summary, {.loss = loss});
    EXPECT_GT(result.partitions[0].leaves, 1);
    Eigen::MatrixXd line(400, 3);
    double fall = 0.0;
    for (int k = 0; k < 40; ++k) {
      const double z = random.uniform(-1.5, 1.5);
      for (Eigen::Index i = 0; i < 400; ++i) {
        line.row(i) << -1.0 + 0.03 * static_cast<double>(i), k % 4 == 3 ? std::nan("") : z, static_cast<double>(k % 3);
      }
      const Eigen::VectorXd y = result.model.predict(line);
      fall = std::max(fall, (y.head(399) - y.tail(399)).maxCoeff());
    }
    return fall;
  };
  llmt::FitOptions free = crisp_trees();
  llmt::FitOptions rising = crisp_trees();
  rising.trends = {llmt::Trend::rising, llmt::Trend::any, llmt::Trend::any};
  for (const double loss : {0.0, 0.15}) {
    EXPECT_GT(largest_fall(free, loss), 0.5) << loss;
    EXPECT_LE(largest_fall(rising, loss), 1e-12) << loss;
  }
  llmt::FitOptions slopes = crisp_trees();
  slopes.trends = {llmt::Trend::any, llmt::Trend::rising_slopes, llmt::Trend::any};
  const llmt::PreparedFit prepared(rows, slopes);
  for (const llmt::Leaf& leaf : llmt::fit_readable(prepared, llmt::fit(prepared).summary).model.leaves(0))
    EXPECT_GE(leaf.slope(0, 1), 0.0);
}

}  // namespace
