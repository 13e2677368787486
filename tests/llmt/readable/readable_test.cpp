// Readable trees: what they find, that they are what they say, and what is refused.
#include "llmt/readable.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "llmt/size.hpp"

namespace {

struct Data {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
};

// Six inputs, of which the first three count: y = 3 + 2 x1 - x2 up to x3 = 0.3, y = 10 - 4 x1 beyond, and noise.
Data two_regimes(Eigen::Index rows, double noise, std::uint64_t seed = 1) {
  llmt::Random random(seed);
  Data data{Eigen::MatrixXd(rows, 6), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < 6; ++j) data.inputs(i, j) = random.uniform(-1.0, 1.0);
    const auto x = data.inputs.row(i);
    data.outputs(i, 0) = (x(2) <= 0.3 ? 3.0 + 2.0 * x(0) - x(1) : 10.0 - 4.0 * x(0)) + noise * random.normal();
  }
  return data;
}

llmt::ReadableResult readable(const llmt::TrainingData& data, const llmt::FitOptions& options = {}, double loss = 0.1) {
  const llmt::PreparedFit prepared(data, options);
  return llmt::fit_readable(prepared, llmt::fit(prepared).summary, {.loss = loss});
}

llmt::ReadableResult readable(const Data& data, const llmt::FitOptions& options = {}, double loss = 0.1) {
  return readable(llmt::TrainingData{data.inputs, data.outputs}, options, loss);
}

llmt::FitOptions crisp() {
  llmt::FitOptions options;
  options.validity = llmt::ValidityChoice::crisp;
  return options;
}

TEST(Readable, FindsTwoRulesWithTheInputsThatCount) {
  const llmt::ReadableResult result = readable(two_regimes(600, 0.1), crisp());
  const llmt::ReadablePartition& partition = result.partitions[0];
  EXPECT_TRUE(partition.is_within_loss);
  EXPECT_EQ(partition.leaves, 2);
  EXPECT_EQ(partition.used_inputs, 3);
  EXPECT_EQ(partition.size, 4 + 9 + 5);
  EXPECT_EQ(partition.size, llmt::expression_size(result.model));
  const llmt::Node& root = result.model.partitions()[0].nodes[0];
  EXPECT_EQ(root.split_input, 2);
  EXPECT_NEAR(root.threshold, 0.3, 0.02);
  const std::vector<llmt::Leaf> leaves = result.model.leaves(0);
  // 3 + 2 x1 - x2 and 10 - 4 x1, with coefficients of standard error below 0.02 and of grain 0.1 or 0.01.
  EXPECT_NEAR(leaves[0].intercept(0), 3.0, 0.1);
  EXPECT_NEAR(leaves[0].slope(0, 0), 2.0, 0.1);
  EXPECT_NEAR(leaves[0].slope(0, 1), -1.0, 0.1);
  EXPECT_NEAR(leaves[1].slope(0, 0), -4.0, 0.1);
  for (const llmt::Leaf& leaf : leaves) {
    for (Eigen::Index k = 0; k < 6; ++k) {
      EXPECT_NEAR(100.0 * leaf.slope(0, k), std::round(100.0 * leaf.slope(0, k)), 1e-9);
    }
    EXPECT_NEAR(100.0 * leaf.intercept(0), std::round(100.0 * leaf.intercept(0)), 1e-9);
  }
}

// y by the leaves' equations alone, in the units of the inputs.
double by_equations(const llmt::Model& model, Eigen::Index partition, const Eigen::RowVectorXd& x) {
  const std::vector<llmt::Leaf> leaves = model.leaves(partition);
  for (const llmt::Leaf& leaf : leaves) {
    bool inside = true;
    for (Eigen::Index j = 0; j < x.size(); ++j) {
      const auto& levels = leaf.levels[j];
      inside = inside && (levels.empty() ? x(j) > leaf.low(j) && x(j) <= leaf.high(j)
                                         : std::ranges::find(levels, static_cast<int>(x(j))) != levels.end());
    }
    if (!inside) continue;
    double y = leaf.intercept(0);
    for (std::size_t k = 0; k < model.regressors().size(); ++k) {
      const llmt::Regressor& regressor = model.regressors()[k];
      const auto factor = [&](int input) { return x(input) - model.inputs()[input].centre; };
      y += leaf.slope(0, k) * (regressor.second_input >= 0 ? factor(regressor.input) * factor(regressor.second_input)
                               : regressor.level >= 0      ? (x(regressor.input) == regressor.level ? 1.0 : 0.0)
                                                           : x(regressor.input));
    }
    return y;
  }
  return std::nan("");
}

// Bent, with a category and a product.
Data mixed(Eigen::Index rows) {
  llmt::Random random(5);
  Data data{Eigen::MatrixXd(rows, 4), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double a = random.uniform(5.0, 9.0);
    const double b = random.uniform(-2.0, 1.0);
    const double colour = static_cast<double>(i % 3);
    data.inputs.row(i) << a, b, colour, random.normal();
    data.outputs(i, 0) = (colour == 1.0 ? 20.0 + a * b : std::abs(a - 7.0) + b * b + colour) + 0.05 * random.normal();
  }
  return data;
}

TEST(Readable, ARoundNumberAtWhichManyRowsLieIsNotTakenToTheOtherSide) {
  // Ten a piece, from 1000 pieces on eight. A third of the orders is of exactly 1000 pieces.
  llmt::Random random(2);
  Data data{Eigen::MatrixXd(600, 2), Eigen::MatrixXd(600, 1)};
  for (Eigen::Index i = 0; i < 600; ++i) {
    const double pieces = i % 3 == 0 ? 1000.0 : std::floor(random.uniform(1.0, 2000.0));
    data.inputs.row(i) << pieces, static_cast<double>(random.below(5));
    data.outputs(i, 0) = pieces * (pieces < 1000.0 ? 0.010 : 0.008) + 0.05 * random.normal();
  }
  const llmt::ReadableResult result = readable(data, crisp(), 0.15);
  EXPECT_EQ(result.partitions[0].leaves, 2);
  Eigen::MatrixXd asked(4, 2);
  asked << 900, 2, 990, 2, 1000, 2, 1100, 2;
  const Eigen::MatrixXd y = result.model.predict(asked);
  EXPECT_NEAR(y(0), 9.0, 0.05);
  EXPECT_NEAR(y(1), 9.9, 0.05);
  EXPECT_NEAR(y(2), 8.0, 0.05);
  EXPECT_NEAR(y(3), 8.8, 0.05);
}

TEST(Readable, PredictsWhatItsEquationsSayWithinTheTrainingExtent) {
  const Data data = mixed(400);
  for (const llmt::LocalTerms terms : {llmt::LocalTerms::linear, llmt::LocalTerms::quadratic}) {
    llmt::FitOptions options = crisp();
    options.terms = terms;
    const llmt::TrainingData rows{.inputs = data.inputs, .outputs = data.outputs, .categorical_inputs = {2}};
    const llmt::ReadableResult result = readable(rows, options, 0.02);
    EXPECT_GT(result.partitions[0].leaves, 1);
    const Eigen::MatrixXd predicted = result.model.predict(data.inputs);
    for (Eigen::Index i = 0; i < data.inputs.rows(); ++i) {
      EXPECT_NEAR(predicted(i, 0), by_equations(result.model, 0, data.inputs.row(i)), 1e-9);
    }
  }
}

TEST(Readable, AnInputBeyondItsTrainingRangeIsHeldThere) {
  const Data data = two_regimes(600, 0.1);
  const llmt::Model model = readable(data, crisp()).model;
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(3, 6);
  x.col(0) << model.inputs()[0].high, 5.0, 500.0;
  const Eigen::MatrixXd y = model.predict(x);
  // Rounded off over a tenth of the range, 0.2, whose half is added at most (B.1), with a slope near 2.
  EXPECT_NEAR(y(1, 0), y(0, 0) + 0.2, 0.02);
  EXPECT_EQ(y(1, 0), y(2, 0));
}

TEST(Readable, OneEquationHoldsEverywhere) {
  llmt::Random random(9);
  Data data{Eigen::MatrixXd(100, 2), Eigen::MatrixXd(100, 1)};
  for (Eigen::Index i = 0; i < 100; ++i) {
    data.inputs.row(i) << random.uniform(0.0, 10.0), random.uniform(1000.0, 1010.0);
    data.outputs(i, 0) = 7.5 - 0.25 * data.inputs(i, 0) + 3.0 * data.inputs(i, 1);
  }
  const llmt::ReadableResult result = readable(data);
  EXPECT_EQ(result.partitions[0].size, 9);
  const llmt::Leaf leaf = result.model.leaves(0)[0];
  EXPECT_NEAR(leaf.intercept(0), 7.5, 1e-9);
  EXPECT_NEAR(leaf.slope(0, 0), -0.25, 1e-12);
  EXPECT_NEAR(leaf.slope(0, 1), 3.0, 1e-12);
  EXPECT_NEAR(result.model.predict(Eigen::RowVector2d(-500.0, 0.0))(0, 0), 132.5, 1e-6);
}

// The folds' models are fitted without the rows on which the error is reported.
TEST(Readable, ReportedErrorIsThatOfTheFoldsModels) {
  const Data data = two_regimes(300, 0.5);
  const llmt::ReadableResult result = readable(data, crisp());
  const std::vector<llmt::Fold> folds = llmt::make_folds(300, {});
  double squares = 0.0;
  ASSERT_EQ(result.intervals.models().size(), folds.size());
  for (std::size_t f = 0; f < folds.size(); ++f) {
    const Eigen::VectorXd residual = result.intervals.models()[f].predict(data.inputs(folds[f].held_out, Eigen::all)) -
                                     Eigen::VectorXd(data.outputs(folds[f].held_out, Eigen::all));
    EXPECT_NEAR(std::sqrt(residual.squaredNorm() / static_cast<double>(residual.size())),
                result.partitions[0].fold_rmse(f), 1e-9);
    squares += residual.squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(squares / 300.0), result.partitions[0].rmse, 1e-9);
}

// A wave in x1 and a line in x2.
Data wave(Eigen::Index rows, std::uint64_t seed) {
  llmt::Random random(seed);
  Data data{Eigen::MatrixXd(rows, 3), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) data.inputs(i, j) = random.uniform(-2.0, 2.0);
    data.outputs(i, 0) = std::sin(2.0 * data.inputs(i, 0)) + 0.3 * data.inputs(i, 1) + 0.1 * random.normal();
  }
  return data;
}

TEST(Readable, ChosenErrorIsWithinTheLossOfTheBestCrispTreeAndSizeFallsWithTheLoss) {
  const Data data = wave(500, 11);
  const llmt::PreparedFit prepared({data.inputs, data.outputs}, crisp());
  const llmt::FitResult fitted = llmt::fit(prepared);
  Eigen::Index before = std::numeric_limits<Eigen::Index>::max();
  for (const double loss : {0.0, 0.05, 0.1, 0.3, 1.0, 10.0}) {
    const llmt::ReadablePartition tree = llmt::fit_readable(prepared, fitted.summary, {.loss = loss}).partitions[0];
    EXPECT_LE(tree.yardstick, fitted.summary.partitions[0].chosen.rmse);
    EXPECT_TRUE(tree.is_within_loss) << loss;
    EXPECT_LE(tree.size, before);
    before = tree.size;
  }
  EXPECT_GT(before, 1);  // no constant: sparse least squares is better than that, and no tree is worse than it
}

// What is said of a tree is its error on new rows: it lies between the errors of the folds, which are printed as the
// spread, in most tables, and on neither side in the mean.
TEST(Readable, ErrorSaidIsThatOnNewRows) {
  const Data fresh = wave(5000, 100);
  for (const double loss : {0.05, 0.3}) {
    int inside = 0;
    double said_over_paid = 0.0;
    constexpr int tables = 8;
    for (int table = 0; table < tables; ++table) {
      const Data data = wave(300, 20 + table);
      const llmt::ReadableResult result = readable(data, crisp(), loss);
      const llmt::ReadablePartition& tree = result.partitions[0];
      const double paid = std::sqrt((result.model.predict(fresh.inputs) - fresh.outputs).squaredNorm() / 5000.0);
      inside += tree.fold_rmse.minCoeff() <= paid && paid <= tree.fold_rmse.maxCoeff() ? 1 : 0;
      said_over_paid += tree.rmse / paid / tables;
    }
    EXPECT_GE(inside, 6) << loss;
    EXPECT_NEAR(said_over_paid, 1.0, 0.06) << loss;
  }
}

TEST(Readable, DataWithoutNoiseKeepTheirDigits) {
  Data data = two_regimes(100, 0.0);
  data.outputs = 1e5 + std::numbers::pi * data.inputs.col(0).array();
  const llmt::ReadableResult line = readable(data);
  EXPECT_TRUE(line.partitions[0].is_within_loss);
  EXPECT_EQ(line.partitions[0].size, 5);
  EXPECT_LT((line.model.predict(data.inputs) - data.outputs).cwiseAbs().maxCoeff(), 1e-7);
  data.outputs.setConstant(0.123456);
  const llmt::ReadableResult constant = readable(data);
  EXPECT_EQ(constant.partitions[0].size, 1);
  EXPECT_NEAR(constant.model.predict(data.inputs)(0, 0), 0.123456, 1e-9);
}

TEST(Readable, SplitsAndEquationsUseTheInputsThatTheyMay) {
  const Data data = two_regimes(400, 0.1);
  llmt::FitOptions options = crisp();
  options.split_inputs = {2, 3};
  options.regression_inputs = {0, 5};
  const llmt::ReadableResult result = readable(data, options, 0.0);
  ASSERT_GT(result.partitions[0].leaves, 1);
  for (const llmt::Node& node : result.model.partitions()[0].nodes) {
    EXPECT_TRUE(node.is_leaf() || node.split_input == 2 || node.split_input == 3);
  }
  for (const llmt::Regressor& regressor : result.model.regressors()) {
    EXPECT_TRUE(regressor.input == 0 || regressor.input == 5);
  }
}

TEST(Readable, SameOnAnyNumberOfThreads) {
  const Data data = two_regimes(200, 0.5);
  llmt::FitOptions options = crisp();
  options.max_threads = 1;
  const llmt::ReadableResult one = readable(data, options);
  options.max_threads = 4;
  const llmt::ReadableResult four = readable(data, options);
  EXPECT_EQ(llmt::to_json(one.model), llmt::to_json(four.model));
  EXPECT_EQ(one.partitions[0].rmse, four.partitions[0].rmse);
}

TEST(Readable, MissingValuesCountAsTheMeanAndGoTheWayOfMostRows) {
  Data data = two_regimes(600, 0.1);
  for (Eigen::Index i = 0; i < 600; i += 15) data.inputs(i, i % 3) = std::nan("");
  const llmt::Model model = readable(data, crisp()).model;
  Eigen::MatrixXd x = Eigen::MatrixXd::Constant(2, 6, 0.1);
  x(0, 2) = std::nan("");  // most rows have x3 <= 0.3
  EXPECT_EQ(model.predict(x)(0, 0), model.predict(x)(1, 0));
  x(0, 2) = 0.1;
  x(0, 0) = std::nan("");
  x(1, 0) = model.inputs()[0].centre;
  EXPECT_NEAR(model.predict(x)(0, 0), model.predict(x)(1, 0), 1e-12);
}

TEST(Readable, ServesSeveralOutputsEachOrTogether) {
  Data data = two_regimes(400, 0.1);
  data.outputs.conservativeResize(Eigen::NoChange, 2);
  data.outputs.col(1) = 100.0 * data.inputs.col(3);
  llmt::FitOptions options = crisp();
  const llmt::ReadableResult each = readable(data, options);
  ASSERT_EQ(each.partitions.size(), 2u);
  EXPECT_EQ(each.partitions[1].size, 5);
  EXPECT_EQ(each.partitions[0].size + each.partitions[1].size, llmt::expression_size(each.model));
  options.shared_partition = true;
  const llmt::ReadableResult shared = readable(data, options);
  ASSERT_EQ(shared.partitions.size(), 1u);
  EXPECT_EQ(shared.partitions[0].size, llmt::expression_size(shared.model));
  EXPECT_EQ(shared.partitions[0].path[shared.partitions[0].taken].size, shared.partitions[0].size);
  EXPECT_TRUE(shared.partitions[0].is_within_loss);
}

TEST(Readable, RowsOfNoWeightAndOutliersOfTheTukeyLossTakeNoPart) {
  Data data = two_regimes(400, 0.1);
  const llmt::ReadableResult clean = readable(data, crisp());
  Data with_more = data;
  with_more.inputs.conservativeResize(410, Eigen::NoChange);
  with_more.outputs.conservativeResize(410, Eigen::NoChange);
  with_more.inputs.bottomRows(10).setConstant(0.9);
  with_more.outputs.bottomRows(10).setConstant(1e4);
  llmt::TrainingData weighted{with_more.inputs, with_more.outputs, Eigen::VectorXd::Ones(410)};
  weighted.weights.tail(10).setZero();
  EXPECT_EQ(llmt::to_json(readable(weighted, crisp()).model), llmt::to_json(clean.model));
  llmt::FitOptions options = crisp();
  options.loss = llmt::Loss::tukey;
  EXPECT_EQ(readable(with_more, options).partitions[0].leaves, 2);
}

TEST(Readable, RefusesWhatItCannotKeep) {
  const Data data = two_regimes(60, 0.1);
  const llmt::FitSummary fitted = llmt::fit(data.inputs, data.outputs, crisp()).summary;
  const auto refused = [&](const llmt::FitOptions& options, double loss, const std::string& word) {
    try {
      llmt::fit_readable(llmt::PreparedFit({data.inputs, data.outputs}, options), fitted, {.loss = loss});
      ADD_FAILURE() << word;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  refused(crisp(), std::nan(""), "loss is nan");
  refused(crisp(), -0.1, "loss is -0.1");
  refused(crisp(), std::numeric_limits<double>::infinity(), "loss is inf");
  llmt::FitOptions options = crisp();
  options.folds.count = 0;
  refused(options, 0.1, "folds.count 0");
  options = {};
  options.validity = llmt::ValidityChoice::blend;
  refused(options, 0.1, "validity");
  options = {};
  options.rule = llmt::GrowthRule::lolimot;
  refused(options, 0.1, "rule");
}

}  // namespace
