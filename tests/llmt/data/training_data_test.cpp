// What a caller knows of rows and columns: words as categories, names, groups.
#include "llmt/training_data.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "llmt/compare.hpp"
#include "llmt/fit.hpp"
#include "llmt/readable.hpp"
#include "oracles/oracles.hpp"

namespace {

using llmt::TrainingData;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

// A number and a colour, in words; the colours shift the output.
const std::vector<std::string> colours = {"red", "green", "blue"};

std::vector<std::string> words(Eigen::Index rows) {
  std::vector<std::string> result;
  for (Eigen::Index row = 0; row < rows; ++row) result.push_back(colours[(row * row) % 3 + (row % 5 == 0 ? 1 : 0)]);
  return result;
}

TrainingData coloured(Eigen::Index rows) {
  TrainingData data{oracle::uniform(rows, 2, 31), Eigen::MatrixXd(rows, 1)};
  const std::vector<std::string> of_rows = words(rows);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const double shift = of_rows[row] == "red" ? 3.0 : of_rows[row] == "green" ? -1.0 : 0.0;
    data.outputs(row, 0) = shift + std::abs(data.inputs(row, 0));
  }
  set_categories(data, 1, of_rows);
  return data;
}

TEST(TrainingData, WordsBecomePlacesInASortedList) {
  TrainingData data{Eigen::MatrixXd::Zero(5, 2), Eigen::MatrixXd::Zero(5, 1)};
  set_categories(data, 1, std::vector<std::string>{"b", "a", "", "c", "a"});
  EXPECT_EQ(data.levels, (std::vector<std::vector<std::string>>{{}, {"a", "b", "c"}}));
  EXPECT_EQ(data.inputs.col(1).head(2), Eigen::Vector2d(1.0, 0.0));
  EXPECT_TRUE(std::isnan(data.inputs(2, 1)));
  EXPECT_EQ(data.inputs.col(1).tail(2), Eigen::Vector2d(2.0, 0.0));
  EXPECT_EQ(data.inputs.col(0), Eigen::VectorXd::Zero(5));
  const Eigen::VectorXd values = llmt::category_values(std::vector<std::string>{"c", "d", ""}, data.levels[1]);
  EXPECT_EQ(values(0), 2.0);
  EXPECT_EQ(values(1), -1.0);
  EXPECT_TRUE(std::isnan(values(2)));
  EXPECT_EQ(message_of([&] { set_categories(data, 2, colours); }),
            "llmt::set_categories: input is 2, there are 2 inputs");
  EXPECT_EQ(message_of([&] { set_categories(data, 0, colours); }),
            "llmt::set_categories: there are 3 words for 5 rows");
}

TEST(TrainingData, AModelAnswersInTheNamesOfTheData) {
  TrainingData data = coloured(120);
  data.input_names = {"age", "colour"};
  data.output_names = {"price"};
  const llmt::Model model = llmt::fit(data).model;
  EXPECT_EQ(model.inputs()[0].name, "age");
  EXPECT_EQ(model.inputs()[1].levels, (std::vector<std::string>{"blue", "green", "red"}));
  EXPECT_EQ(model.outputs()[0].name, "price");
  Eigen::MatrixXd query = Eigen::MatrixXd::Zero(3, 2);
  query.col(1) = llmt::category_values(colours, model.inputs()[1].levels);
  EXPECT_LT((model.predict(query).col(0) - Eigen::Vector3d(3.0, -1.0, 0.0)).cwiseAbs().maxCoeff(), 0.2);
  // The same names, whoever asks for the model.
  const llmt::PreparedFit prepared(data, {.max_leaves = 4});
  const llmt::FitResult fitted = llmt::fit(prepared);
  EXPECT_EQ(fitted.model.inputs()[1].levels, model.inputs()[1].levels);
  EXPECT_EQ(llmt::fit_readable(prepared, fitted.summary).model.outputs()[0].name, "price");
}

TEST(TrainingData, SomeNamesMayBeMissing) {
  TrainingData data = coloured(80);
  data.inputs.conservativeResize(Eigen::NoChange, 3);
  for (int row = 0; row < 80; ++row) data.inputs(row, 2) = row % 4;
  data.levels.emplace_back();
  data.categorical_inputs = {2};
  const llmt::Model model = llmt::fit(data, {.max_leaves = 3}).model;
  EXPECT_EQ(model.inputs()[0].name, "x1");
  EXPECT_EQ(model.inputs()[1].levels, (std::vector<std::string>{"blue", "green", "red"}));
  EXPECT_EQ(model.inputs()[2].levels, (std::vector<std::string>{"0", "1", "2", "3"}));
  EXPECT_EQ(model.outputs()[0].name, "y");
}

// A category of which no row takes part is missing for the model, like any that it has not seen.
TEST(TrainingData, CategoriesThatNoRowTakesPartWith) {
  TrainingData data = coloured(120);
  data.weights = (data.inputs.col(1).array() < 2.0).cast<double>();
  const llmt::FitOptions options{.max_leaves = 4};
  const llmt::Model model = llmt::fit(data, options).model;
  EXPECT_EQ(model.inputs()[1].levels, (std::vector<std::string>{"blue", "green"}));
  Eigen::MatrixXd query = Eigen::MatrixXd::Constant(2, 2, 0.5);
  query.col(1) << 2.0, nan;
  const Eigen::MatrixXd predicted = model.predict(query);
  EXPECT_EQ(predicted(0, 0), predicted(1, 0));
  data.weights = {};
  data.levels[1].emplace_back("yellow");
  EXPECT_EQ(llmt::fit(data, options).model.inputs()[1].levels.size(), 3U);
  const std::vector<llmt::Method> methods = llmt::usual_methods(options, data);
  EXPECT_EQ(llmt::compare(data, {methods.front()}, {.folds = {.count = 2}}).methods.size(), 1U);
}

TEST(TrainingData, CodesAreLookedForUnlessTheCallerSaysThatThereAreNone) {
  TrainingData data{oracle::uniform(300, 2, 32), 0.2 * oracle::uniform(300, 1, 35)};
  const std::vector<double> of_code = {0.0, 1.5, -1.2, 0.8};
  for (int row = 0; row < 300; ++row) {
    data.inputs(row, 0) = row % 4;
    data.outputs(row, 0) += of_code[row % 4] * (1.5 + data.inputs(row, 1)) + std::sin(3.0 * data.inputs(row, 1));
  }
  EXPECT_EQ(llmt::fit(data).summary.codes.taken, std::vector<int>{0});
  data.may_have_codes = false;
  EXPECT_TRUE(llmt::fit(data).summary.codes.taken.empty());
  const std::vector<llmt::Method> methods = {{"tree", {.max_leaves = 4}}};
  const double as_numbers = llmt::compare(data, methods).methods[0].cv_rmse;
  data.may_have_codes = true;
  EXPECT_LT(llmt::compare(data, methods).methods[0].cv_rmse, as_numbers);
}

// Groups are dealt in order of first appearance; the rows of one are in one fold, wherever they stand.
TEST(TrainingData, GroupsAreHeldOutTogether) {
  TrainingData data{oracle::uniform(60, 2, 33), oracle::uniform(60, 1, 34)};
  for (int row = 0; row < 60; ++row) data.groups.push_back((row * 7) % 12 - 5.5);
  for (const llmt::FoldKind kind : {llmt::FoldKind::random, llmt::FoldKind::contiguous}) {
    const llmt::FitOptions options{.max_leaves = 2, .folds = {.count = 4, .kind = kind}};
    const std::vector<std::vector<Eigen::Index>> held_out = llmt::fit(data, options).summary.held_out;
    ASSERT_EQ(held_out.size(), 4U);
    for (std::size_t fold = 0; fold < held_out.size(); ++fold) {
      std::set<double> labels;
      for (const Eigen::Index row : held_out[fold]) labels.insert(data.groups[row]);
      EXPECT_EQ(labels.size(), 3U);
      EXPECT_EQ(held_out[fold].size(), 15U);
      if (kind == llmt::FoldKind::random) continue;
      // The labels of the first rows, three at a time.
      for (std::size_t k = 0; k < 3; ++k) EXPECT_TRUE(labels.contains(data.groups[3 * fold + k])) << fold;
    }
  }
}

TEST(TrainingData, MistakesAreNamedBeforeTheFit) {
  const auto refused = [](const std::function<void(TrainingData&)>& change) {
    TrainingData data = coloured(20);
    change(data);
    return message_of([&] { llmt::fit(data); });
  };
  EXPECT_EQ(refused([](TrainingData& data) { data.weights.setOnes(19); }),
            "llmt::fit: weights has 19 entries, inputs has 20 rows");
  EXPECT_EQ(refused([](TrainingData& data) {
              data.weights.setOnes(20);
              data.weights(7) = nan;
            }),
            "llmt::fit: weights(7), counted from 0, is nan, it must be from 0 to 1e150");
  EXPECT_EQ(refused([](TrainingData& data) {
              data.weights.setOnes(20);
              data.weights(7) = -2.0;
            }),
            "llmt::fit: weights(7), counted from 0, is -2, it must be from 0 to 1e150");
  EXPECT_EQ(refused([](TrainingData& data) { data.groups.assign(21, 1.0); }),
            "llmt::fit: groups has 21 entries, inputs has 20 rows");
  EXPECT_EQ(refused([](TrainingData& data) {
              data.groups.assign(20, 1.0);
              data.groups[3] = nan;
            }),
            "llmt::fit: groups[3] is nan, it must be finite");
  EXPECT_EQ(refused([](TrainingData& data) { data.levels.pop_back(); }),
            "llmt::fit: levels has 1 entries, there are 2 inputs");
  EXPECT_EQ(refused([](TrainingData& data) { data.levels[1].pop_back(); }),
            "llmt::fit: a category of input 1 is 2, it must be a whole number from 0 to 1: it has 2 levels");
  EXPECT_EQ(refused([](TrainingData& data) { data.inputs(4, 1) = -1.0; }),
            "llmt::fit: a category of input 1 is -1, it must be a whole number from 0 to 2: it has 3 levels");
  EXPECT_EQ(refused([](TrainingData& data) { data.inputs(4, 1) = 0.5; }),
            "llmt::fit: a category of input 1 is 0.5, it must be a whole number from 0 to 2: it has 3 levels");
  EXPECT_EQ(refused([](TrainingData& data) { data.levels[1][2] = "blue"; }),
            "llmt::fit: two entries of levels[1] are \"blue\"");
  EXPECT_EQ(refused([](TrainingData& data) { data.levels[1].resize(llmt::most_categories + 1, "many"); }),
            "llmt::fit: levels[1] has 10001 entries, it must have at most 10000");
  EXPECT_EQ(refused([](TrainingData& data) {
              data.categorical_inputs = {1, 1};
            }),
            "llmt::fit: categorical_inputs names column 1 twice");
  EXPECT_EQ(refused([](TrainingData& data) { data.input_names = {"age"}; }),
            "llmt::fit: input_names has 1 entries, there are 2 inputs");
  EXPECT_EQ(refused([](TrainingData& data) {
              data.input_names = {"age", "age"};
            }),
            "llmt::fit: two entries of input_names are \"age\"");
  EXPECT_EQ(refused([](TrainingData& data) {
              data.output_names = {"price", "cost"};
            }),
            "llmt::fit: output_names has 2 entries, there are 1 outputs");
}

}  // namespace
