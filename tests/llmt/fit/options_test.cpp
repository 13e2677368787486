// Mistakes of the caller are named.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "oracles/random_trees.hpp"

namespace {

using namespace random_trees;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(Fit, MistakesInShapesAndLimitsAreNamed) {
  const Eigen::MatrixXd x = oracle::uniform(10, 2, 15);
  const Eigen::MatrixXd y = x.col(0);
  EXPECT_EQ(thrown([&] { llmt::fit(x, y.topRows(9)); }), "llmt::fit: inputs has 10 rows, outputs has 9");
  EXPECT_EQ(thrown([&] { llmt::fit(Eigen::MatrixXd(0, 2), Eigen::MatrixXd(0, 1)); }),
            "llmt::fit: inputs is 0 x 2, at least one row and one column are needed");
  Eigen::MatrixXd bad = x;
  bad(3, 1) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(thrown([&] { llmt::fit(bad, y); }),
            "llmt::fit: inputs(3, 1) is inf, it must be finite, or NaN where it is missing (rows and columns counted "
            "from 0)");
  bad(3, 1) = std::nan("");
  EXPECT_EQ(thrown([&] { llmt::fit(x, bad); }),
            "llmt::fit: outputs(3, 1) is nan, it must be finite (rows and columns counted from 0)");
  EXPECT_EQ(thrown([&] { llmt::fit(x, y, {.split_inputs = {2}}); }),
            "llmt::fit: split_inputs names column 2, there are 2");
  EXPECT_EQ(thrown([&] {
              llmt::fit(x, y, {.regression_inputs = {1, 1}});
            }),
            "llmt::fit: regression_inputs names column 1 twice");
  EXPECT_EQ(thrown([&] { llmt::fit(x, y, {.significance = nan}); }),
            "llmt::fit: significance is nan, it must be a number");
  EXPECT_EQ(thrown([&] { llmt::fit(x, y, {.folds = {.count = 1}}); }),
            "llmt::fit: folds.count is 1, it must be 0 or at least 2");
}

TEST(Fit, MistakesInWeightsCategoriesAndBlendsAreNamed) {
  const Eigen::MatrixXd x = oracle::uniform(20, 2, 72).cwiseAbs();
  const Eigen::MatrixXd y = x.col(0);
  const auto error = [&](const std::function<void(llmt::FitOptions&)>& change) {
    llmt::FitOptions options;
    change(options);
    return thrown([&] { llmt::fit(x, y, options); });
  };
  const auto starts = [](const std::string& text, const std::string& with) {
    return text.rfind(with, 0) == 0 ? with : text;
  };
  const auto refused = [&](llmt::TrainingData data) {
    data.inputs = x;
    data.outputs = y;
    return thrown([&] { llmt::fit(data); });
  };
  const std::string category = refused({.categorical_inputs = {1}});
  EXPECT_EQ(starts(category, "llmt::fit: a category of input 1 is 0."), "llmt::fit: a category of input 1 is 0.");
  EXPECT_NE(category.find("it must be a whole number from 0 to 9999"), std::string::npos) << category;
  Eigen::MatrixXd halves = x;
  halves.col(1).setConstant(1.5);
  EXPECT_EQ(thrown([&] { llmt::fit({.inputs = halves, .outputs = y, .categorical_inputs = {1}}); }),
            "llmt::fit: a category of input 1 is 1.5, it must be a whole number from 0 to 9999");
  EXPECT_EQ(refused({.categorical_inputs = {2}}), "llmt::fit: categorical_inputs names column 2, there are 2");
  EXPECT_EQ(refused({.weights = Eigen::VectorXd::Constant(20, -1.0)}),
            "llmt::fit: weights(0), counted from 0, is -1, it must be from 0 to 1e150");
  EXPECT_EQ(refused({.weights = Eigen::VectorXd::Zero(20)}), "llmt::fit: the largest weight is 0, it must be positive");
  EXPECT_EQ(refused({.weights = Eigen::VectorXd::Ones(19)}), "llmt::fit: weights has 19 entries, inputs has 20 rows");
  EXPECT_EQ(refused({.groups = {1.0, 2.0}}), "llmt::fit: groups has 2 entries, inputs has 20 rows");
  EXPECT_EQ(refused({.levels = {{"a", "b"}}}), "llmt::fit: levels has 1 entries, there are 2 inputs");
  EXPECT_EQ(thrown([&] {
              llmt::fit({.inputs = x.array().ceil() + 1.0, .outputs = y, .levels = {{"a", "b"}, {}}});
            }),
            "llmt::fit: a category of input 0 is 2, it must be a whole number from 0 to 1: it has 2 levels");
  EXPECT_EQ(error([](auto& options) { options.expert.widths = {0.0}; }),
            "llmt::fit: expert.widths is 0, it must be finite and positive");
  EXPECT_EQ(error([](auto& options) {
              options.expert.widths = {1.0, -2.0};
            }),
            "llmt::fit: expert.widths is -2, it must be finite and positive");
  EXPECT_EQ(error([](auto& options) { options.expert.ridges = {-1.0}; }),
            "llmt::fit: expert.ridges is -1, it must be finite and not negative");
  EXPECT_EQ(error([](auto& options) { options.expert.shrinkages = {nan}; }),
            "llmt::fit: expert.shrinkages is nan, it must be finite and not negative");
  const llmt::Model model = llmt::fit(x, y).model;
  Eigen::MatrixXd query = x;
  query(2, 1) = -std::numeric_limits<double>::infinity();
  EXPECT_EQ(thrown([&] { model.predict(query); }),
            "llmt::Model::predict: inputs(2, 1) is -inf, it must be finite, or NaN where it is missing (rows and "
            "columns counted from 0)");
}

}  // namespace
