// Sums of trees on rows that lack what no row of the training lacked, and on categories that it had not.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"

namespace {

constexpr double no_value = std::numeric_limits<double>::quiet_NaN();
constexpr double unknown = -1.0;

// The levels have 55, 30, 12 and 3 % of the rows: the mean of their offsets is 0.55.
constexpr std::array<double, 4> offsets = {0.0, -4.0, 2.5, 48.333};
constexpr std::array<double, 4> parts = {0.55, 0.85, 0.97, 1.0};

// y = offset of the level + 2 x.
llmt::TrainingData of_levels(Eigen::Index rows) {
  llmt::Random random(7);
  llmt::TrainingData data;
  data.inputs.resize(rows, 2);
  data.outputs.resize(rows, 1);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double part = (static_cast<double>(i) + 0.5) / static_cast<double>(rows);
    int level = 0;
    while (part > parts[level]) ++level;
    data.inputs(i, 0) = level;
    data.inputs(i, 1) = random.uniform(-1.0, 1.0);
    data.outputs(i, 0) = offsets[level] + 2.0 * data.inputs(i, 1);
  }
  data.categorical_inputs = {0};
  return data;
}

// 300 rows are a mean of variants, 1000 one sum, 6000 one after a race.
TEST(Unseen, CategoryHasTheMeanOfTheLevels) {
  for (const Eigen::Index rows : {300, 1000, 6000}) {
    const llmt::TrainingData data = of_levels(rows);
    const llmt::BoostedModel model = llmt::fit_boosted(data).model;
    Eigen::MatrixXd asked(4, 2);
    asked << unknown, 0.5, no_value, 0.5, 7.0, -0.5, 0.0, 0.5;
    const Eigen::VectorXd y = model.predict(asked).col(0);
    EXPECT_NEAR(y(0), 0.55 + 1.0, 0.3) << rows;
    EXPECT_EQ(y(1), y(0)) << rows;
    EXPECT_NEAR(y(2), 0.55 - 1.0, 0.3) << rows;
    EXPECT_NEAR(y(3), 1.0, 0.3) << rows;
    EXPECT_EQ(llmt::incomplete_rows(model, asked), (std::vector<Eigen::Index>{0, 1, 2}));
  }
}

// The output bends in x_0, and x_1 is independent of it: without x_0 nothing but the mean over x_0 is known, which is
// 0 for both terms. The extremes are 1.3 and -2.7 away.
TEST(Unseen, EmptyNumberHasTheMeanOverIt) {
  for (const Eigen::Index rows : {300, 1000, 6000}) {
    llmt::Random random(3);
    llmt::TrainingData data;
    data.inputs.resize(rows, 2);
    for (double& value : data.inputs.reshaped()) value = random.uniform(-1.0, 1.0);
    const auto x = data.inputs.array();
    data.outputs = (4.0 * (1.0 / 3.0 - x.col(0).square()) + 3.0 * x.col(1)).matrix();
    const llmt::BoostedModel model = llmt::fit_boosted(data).model;
    for (const double at : {-0.7, 0.0, 0.7}) {
      const double mean = data.outputs.mean() + 3.0 * (at - x.col(1).mean());
      EXPECT_NEAR(model.predict(Eigen::RowVector2d(no_value, at))(0), mean, 0.15) << rows << " rows, x_1 = " << at;
    }
    EXPECT_NEAR(model.predict(Eigen::RowVector2d(no_value, no_value))(0), data.outputs.mean(), 0.15) << rows;
  }
}

// Held-out rows lack what the others have: the error that is printed is that of the model for such rows.
TEST(Unseen, HeldOutRowsArePredictedAsNewOnes) {
  llmt::TrainingData data = of_levels(1000);
  data.inputs.col(0) *= 3.0;  // a number with gaps
  data.categorical_inputs = {};
  for (Eigen::Index row = 0; row < 1000; row += 10) {
    data.held_out.push_back(row);
    data.inputs(row, 0) = no_value;
  }
  const llmt::BoostResult result = llmt::fit_boosted(data);
  const Eigen::VectorXd predicted = result.model.predict(data.inputs(data.held_out, Eigen::all)).col(0);
  const double error = llmt::rmse(predicted, data.outputs(data.held_out, Eigen::all))(0);
  EXPECT_NEAR(result.summaries[0].rmse, error, 0.002 * error);  // the file's shares and means have three digits
}

TEST(Unseen, TableOfLeavesAndOneRowAgree) {
  const llmt::BoostedModel model = llmt::fit_boosted(of_levels(1000)).model;
  Eigen::MatrixXd many = of_levels(400).inputs;
  for (Eigen::Index row = 0; row < 400; row += 7) many(row, row % 2) = no_value;
  const Eigen::VectorXd together = model.predict(many).col(0);
  for (Eigen::Index row = 0; row < 400; ++row) EXPECT_EQ(model.predict(many.row(row))(0), together(row)) << row;
}

// 300 levels, of which the last 45 are rare: those are told from the others, not from each other.
TEST(Unseen, RareLevelsBeyondTheBoundAreTakenTogether) {
  llmt::Random random(5);
  constexpr int levels = 300;
  llmt::TrainingData data;
  std::vector<int> level_of;
  for (int level = 0; level < levels; ++level) {
    level_of.insert(level_of.end(), level < llmt::most_boosted_levels ? 12 : 4, level);
  }
  const Eigen::Index rows = std::ssize(level_of);
  data.inputs.resize(rows, 2);
  data.outputs.resize(rows, 1);
  const auto offset = [](int level) { return level < llmt::most_boosted_levels ? level % 7 : 20.0; };
  for (Eigen::Index i = 0; i < rows; ++i) {
    data.inputs(i, 0) = level_of[i];
    data.inputs(i, 1) = random.uniform();
    data.outputs(i, 0) = offset(level_of[i]) + data.inputs(i, 1);
  }
  data.categorical_inputs = {0};
  const llmt::BoostResult result = llmt::fit_boosted(data);
  EXPECT_EQ(result.model.sums()[0].features.size(), llmt::most_boosted_levels + 1U);
  EXPECT_LT(result.summaries[0].rmse, 1.0);
  for (const int level : {0, 100, 254, 255, 280, 299}) {
    EXPECT_NEAR(result.model.predict(Eigen::RowVector2d(level, 0.5))(0), offset(level) + 0.5, 0.7) << level;
  }
}

}  // namespace
