// Contributions to predictions of sums of trees, against the definition of Shapley values.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "explain/game_rule.hpp"
#include "llmt/boosted.hpp"
#include "llmt/boosted_explain.hpp"
#include "oracles/coalitions.hpp"
#include "oracles/random_boosted.hpp"

namespace {

constexpr double no_limit = 1e6;

TEST(BoostedAttribution, IsTheShapleyValueOfEveryInput) {
  const std::vector<random_boosted::Kind> kinds = {{.soft = false, .limit = no_limit},
                                                   {.soft = false, .limit = 1.0},
                                                   {.soft = true, .limit = no_limit},
                                                   {.soft = true, .limit = 0.7},
                                                   {.leaves = 1},
                                                   {.leaves = 40, .soft = true, .limit = 2.0},
                                                   {.leaves = 1, .turned = true},
                                                   {.leaves = 40, .soft = true, .limit = 2.0, .turned = true}};
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    const llmt::BoostedModel model = random_boosted::model(kinds[k], 11 + k);
    const Eigen::MatrixXd background = random_boosted::rows(7, 100 + k);
    const Eigen::MatrixXd x = random_boosted::rows(40, 200 + k);
    double largest = 0.0;
    for (Eigen::Index row = 0; row < x.rows(); ++row) {
      const Eigen::VectorXd point = x.row(row).transpose();
      const Eigen::MatrixXd expected = oracle::by_all_coalitions(model, point, background);
      const Eigen::MatrixXd found = llmt::attribute(model, point, background).contributions;
      EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-11) << "kind " << k << ", row " << row;
      largest = std::max(largest, expected.cwiseAbs().maxCoeff());
    }
    EXPECT_GT(largest, 0.1) << "kind " << k << " would prove little";
  }
}

// Coalitions of a large background are asked for in several parts.
TEST(BoostedAttribution, OfALargeBackgroundIsTheShapleyValueToo) {
  const llmt::BoostedModel model = random_boosted::model({.turned = true}, 3);
  const Eigen::MatrixXd background = random_boosted::rows(300, 4);
  const Eigen::VectorXd point = random_boosted::rows(1, 5).row(0).transpose();
  const Eigen::MatrixXd expected = oracle::by_all_coalitions(model, point, background);
  const Eigen::MatrixXd found = llmt::attribute(model, point, background).contributions;
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT(expected.cwiseAbs().maxCoeff(), 0.01);
}

// Half the number of inputs that meet in a leaf, rounded up to an even number.
TEST(BoostedAttribution, TheOrderOfIntegrationFollowsTheInputsThatMeet) {
  std::vector<llmt::BoostedFeature> features;
  for (int input = 0; input < 12; ++input) features.push_back({.inputs = {input}});
  for (int input = 0; input < 12; input += 2) features.push_back({.inputs = {input, input + 1}, .factors = {1.0, 1.0}});
  const auto order = [&](int split, const std::vector<int>& of_leaf) {
    llmt::BoostedTree tree;
    if (split >= 0) tree.splits = {{.feature = split, .left = -1, .right = -2}};
    tree.leaves = {{.features = of_leaf, .slopes = std::vector<double>(of_leaf.size(), 1.0)}, {}};
    return llmt::order_for(tree, features);
  };
  EXPECT_EQ(order(-1, {}), 2);
  EXPECT_EQ(order(-1, {0, 1, 2, 3}), 2);
  EXPECT_EQ(order(-1, {0, 1, 2, 3, 4}), 4);
  EXPECT_EQ(order(-1, {0, 1, 2, 3, 12, 13}), 2);  // pairs of the same four
  EXPECT_EQ(order(4, {0, 1, 2, 3}), 4);
  EXPECT_EQ(order(3, {0, 1, 2, 3}), 2);
  EXPECT_EQ(order(-1, {12, 13, 14, 15}), 4);
  EXPECT_EQ(order(8, {12, 13, 14, 15}), 6);
}

TEST(BoostedAttribution, AddsUpToThePredictionOfAFittedSum) {
  llmt::Random random(3);
  llmt::TrainingData data{.inputs = random_boosted::rows(600, 1), .outputs = Eigen::MatrixXd(600, 1)};
  for (Eigen::Index i = 0; i < 600; ++i) {
    const auto x = data.inputs.row(i).unaryExpr([](double value) { return std::isnan(value) ? 0.5 : value; });
    data.outputs(i, 0) = std::abs(x(0)) + x(1) * x(2) + (x(4) == 1.0 ? 2.0 : 0.0) + 0.1 * random.normal();
  }
  data.categorical_inputs = {4};
  const llmt::BoostedModel model = llmt::fit_boosted(data, {.max_rounds = 60}).model;
  const Eigen::MatrixXd background = llmt::background_of(data.inputs, 30);
  ASSERT_EQ(background.rows(), 30);
  const Eigen::MatrixXd x = data.inputs.topRows(25);
  const llmt::Attributions found = llmt::attribute_rows(model, x, background, 1);
  EXPECT_EQ(found.predictions, model.predict(x));
  EXPECT_NEAR(found.reference(0), model.predict(background).mean(), 1e-12);
  const Eigen::VectorXd sums = found.contributions[0].rowwise().sum();
  EXPECT_LT((found.predictions.col(0) - sums).array().operator-(found.reference(0)).abs().maxCoeff(), 1e-9);
  // The input that the output does not depend on has the least.
  Eigen::Index least = 0;
  const Eigen::MatrixXd importance = llmt::importance(model, data.inputs.topRows(40));
  importance.row(0).minCoeff(&least);
  EXPECT_EQ(least, 3);
  EXPECT_NEAR(importance.sum(), 1.0, 1e-12);
}

TEST(BoostedAttribution, IsTheSameBytesAtAnyNumberOfThreads) {
  const llmt::BoostedModel model = random_boosted::model({.trees = 20}, 5);
  const Eigen::MatrixXd x = random_boosted::rows(50, 6);
  const Eigen::MatrixXd background = random_boosted::rows(9, 7);
  const llmt::Attributions one = llmt::attribute_rows(model, x, background, 1);
  for (const int threads : {2, 8}) {
    const llmt::Attributions more = llmt::attribute_rows(model, x, background, threads);
    EXPECT_EQ(more.contributions[0], one.contributions[0]) << threads;
    EXPECT_EQ(more.contributions[1], one.contributions[1]) << threads;
  }
}

TEST(PartialDependence, IsTheMeanOfPredictionsWithOneInputHeld) {
  const llmt::BoostedModel model = random_boosted::model({}, 8);
  const Eigen::MatrixXd x = random_boosted::rows(60, 9);
  const Eigen::VectorXd values = Eigen::Vector3d{-1.0, 0.25, random_boosted::no_value};
  const Eigen::MatrixXd found = llmt::partial_dependence(model, x, 2, values);
  for (Eigen::Index k = 0; k < 3; ++k) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (Eigen::Index row = 0; row < x.rows(); ++row) {
      Eigen::MatrixXd one = x.row(row);
      one(0, 2) = values(k);
      sum += model.predict(one).transpose();
    }
    EXPECT_LT((found.row(k).transpose() - sum / 60.0).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(BoostedAttribution, EndsAtTheRowAtWhichItIsStopped) {
  const llmt::BoostedModel model = random_boosted::model({.trees = 20}, 5);
  const Eigen::MatrixXd x = random_boosted::rows(50, 6);
  int reports = 0;
  const llmt::Progress stop = [&](const llmt::ProgressReport&) { return ++reports < 4; };
  EXPECT_THROW(llmt::importance(model, x, 1, stop), llmt::Cancelled);
  EXPECT_EQ(reports, 4);
  reports = 0;
  EXPECT_THROW(llmt::partial_dependence(model, x, 2, Eigen::VectorXd::LinSpaced(9, -1.0, 1.0), 1, stop),
               llmt::Cancelled);
  EXPECT_EQ(reports, 4);
}

void expect_refusal(const std::function<void()>& call, const std::string& words) {
  try {
    call();
    FAIL() << words;
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

TEST(BoostedAttribution, SaysWhatIsWrong) {
  const llmt::BoostedModel model = random_boosted::model({}, 1);
  const Eigen::MatrixXd x = random_boosted::rows(5, 1);
  expect_refusal([&] { llmt::attribute_rows(model, x, x.topRows(0)); }, "background is 0 x 5");
  expect_refusal([&] { llmt::attribute_rows(model, x.leftCols(4), x); }, "inputs is 5 x 4");
  expect_refusal([&] { llmt::importance(model, x.topRows(0)); }, "inputs is 0 x 5");
  Eigen::MatrixXd infinite = x;
  infinite(2, 1) = std::numeric_limits<double>::infinity();
  expect_refusal([&] { llmt::attribute_rows(model, x, infinite); }, "background(2, 1) is inf");
  expect_refusal([&] { llmt::partial_dependence(model, x, 5, Eigen::VectorXd::Zero(1)); }, "there is no input 5");
}

}  // namespace
