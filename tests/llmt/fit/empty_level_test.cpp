// Missing values of a category are a level of their own.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "llmt/boosted.hpp"
#include "llmt/explain.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "llmt/random.hpp"
#include "llmt/readable.hpp"
#include "llmt/teach.hpp"
#include "oracles/edited.hpp"
#include "oracles/thrown.hpp"

namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();
constexpr double unknown = -1.0;

// y = 0, 1, 2 of the words, 6 where there is none in a row of five, + 2 x and a noise of 0.05.
llmt::TrainingData table(Eigen::Index rows, bool named = true) {
  llmt::Random random(11);
  llmt::TrainingData data;
  data.inputs.resize(rows, 2);
  data.outputs.resize(rows, 1);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const int kind = static_cast<int>(i % 5);
    data.inputs(i, 0) = kind == 4 ? missing : kind % 3;
    data.inputs(i, 1) = random.uniform();
    data.outputs(i, 0) = (kind == 4 ? 6.0 : kind % 3) + 2.0 * data.inputs(i, 1) + 0.05 * random.normal();
  }
  data.categorical_inputs = {0};
  if (named) data.levels = {{"a", "b", "c"}, {}};
  return data;
}

// x = 0.5: 1 more than the level says.
Eigen::MatrixXd queries() {
  Eigen::MatrixXd asked(4, 2);
  asked << 0.0, 0.5, 1.0, 0.5, 2.0, 0.5, missing, 0.5;
  return asked;
}

template <class AnyModel>
void expect_levels(const AnyModel& model, double tolerance, const std::string& what) {
  const Eigen::VectorXd y = model.predict(queries()).col(0);
  const Eigen::Vector4d expected(1.0, 2.0, 3.0, 7.0);
  EXPECT_LT((y - expected).cwiseAbs().maxCoeff(), tolerance) << what << ": " << y.transpose();
}

TEST(EmptyLevel, IsLearnedByEveryTree) {
  for (const bool named : {true, false}) {
    const llmt::TrainingData data = table(300, named);
    for (const auto& choice : llmt::choices<llmt::GrowthRule>()) {
      llmt::FitOptions options;
      options.rule = choice.value;
      const llmt::FitResult result = llmt::fit(data, options);
      EXPECT_EQ(result.model.inputs()[0].levels.size(), 4U);
      EXPECT_TRUE(result.model.inputs()[0].has_empty_level());
      EXPECT_EQ(result.summary.missing_values, 60);
      // LOLIMOT has no splits on categories, but indicators; the trees of all rules are near the truth.
      expect_levels(result.model, 0.15, std::string(choice.name));
      EXPECT_LT(result.summary.partitions[0].chosen.rmse, 0.12) << choice.name;
    }
    llmt::FitOptions crisp;
    crisp.validity = llmt::ValidityChoice::crisp;
    expect_levels(llmt::fit(data, crisp).model, 0.15, "crisp");
    expect_levels(llmt::fit_taught(data).fit.model, 0.15, "taught");
    const llmt::PreparedFit prepared(data);
    expect_levels(llmt::fit_readable(prepared, llmt::fit(prepared).summary).model, 0.15, "readable");
    const llmt::BoostResult sum = llmt::fit_boosted(data);
    EXPECT_TRUE(sum.model.inputs()[0].has_empty_level());
    expect_levels(sum.model, 0.15, "sum");
  }
}

TEST(EmptyLevel, IsNotThatOfAnUnknownCategory) {
  const llmt::TrainingData data = table(300);
  const Eigen::RowVector2d asked(unknown, 0.5);
  const double mean = data.outputs.mean() + 2.0 * (0.5 - data.inputs.col(1).mean());
  EXPECT_NEAR(llmt::fit(data).model.predict(asked)(0), mean, 0.5);
  EXPECT_NEAR(llmt::fit_boosted(data).model.predict(asked)(0), mean, 0.5);
}

// Rows without a word are as complete as the others, and their intervals hold them.
TEST(EmptyLevel, HasIntervalsAsOtherLevels) {
  const llmt::FitResult result = llmt::fit(table(300));
  const llmt::Bounds bounds = result.intervals.predict(queries(), 0.9);
  EXPECT_TRUE(bounds.uncalibrated.empty());
  for (Eigen::Index row = 0; row < 4; ++row) {
    const double expected = row == 3 ? 7.0 : 1.0 + static_cast<double>(row);
    EXPECT_LT(bounds.lower(row, 0), expected);
    EXPECT_GT(bounds.upper(row, 0), expected);
    EXPECT_LT(bounds.upper(row, 0) - bounds.lower(row, 0), 0.5);
  }
}

TEST(EmptyLevel, IsInFiles) {
  const llmt::TrainingData data = table(300);
  const llmt::FitResult result = llmt::fit(data);
  const std::string text = llmt::to_json(result.model);
  const llmt::Model read = llmt::from_json(text);
  EXPECT_EQ(read.inputs()[0].levels, (std::vector<std::string>{"a", "b", "c", ""}));
  Eigen::MatrixXd asked(5, 2);
  asked << queries(), Eigen::RowVector2d(unknown, 0.5);
  const Eigen::MatrixXd predicted = result.model.predict(asked);
  EXPECT_EQ(read.predict(asked), predicted);
  EXPECT_NE(oracle::thrown<std::runtime_error>([&] {
              llmt::from_json(oracle::replaced(text, "\"version\": 5", "\"version\": 4"));
            }).find("a file of version 4 has no level of missing values"),
            std::string::npos);
  const llmt::BoostedModel sum = llmt::fit_boosted(data).model;
  const llmt::BoostedModel read_sum = llmt::boosted_from_json(llmt::to_json(sum));
  EXPECT_EQ(read_sum.predict(asked), sum.predict(asked));
}

// The contributions of a row without a word, as all others, add up to its prediction beyond that of the reference.
TEST(EmptyLevel, IsExplained) {
  const llmt::Model model = llmt::fit(table(300)).model;
  const llmt::Attribution of_row = llmt::attribute(model, Eigen::Vector2d(missing, 0.9), llmt::reference_point(model));
  EXPECT_NEAR(of_row.prediction(0), 7.8, 0.15);
  EXPECT_NEAR(of_row.reference(0) + of_row.contributions.sum(), of_row.prediction(0), 1e-9);
  EXPECT_GT(of_row.contributions(0, 0), 3.0);
}

// Months as numbers, without an order in their effect; a seventh of the rows has none.
TEST(EmptyLevel, FollowsCodes) {
  llmt::Random random(2);
  llmt::TrainingData data;
  data.inputs.resize(420, 2);
  data.outputs.resize(420, 1);
  const std::vector<double> of_month = {0.0, 3.0, -2.0, 1.0, -3.0, 2.0, 8.0};
  for (Eigen::Index i = 0; i < 420; ++i) {
    data.inputs(i, 0) = i % 7 == 6 ? missing : static_cast<double>(i % 7 + 1);
    data.inputs(i, 1) = random.uniform();
    data.outputs(i, 0) = of_month[i % 7] + data.inputs(i, 1) + 0.1 * random.normal();
  }
  const llmt::FitResult result = llmt::fit(data);
  ASSERT_EQ(result.summary.codes.taken, std::vector<int>{0});
  EXPECT_EQ(result.model.inputs()[0].codes.size(), 6U);
  EXPECT_TRUE(result.model.inputs()[0].has_empty_level());
  EXPECT_EQ(result.summary.missing_values, 60);
  const llmt::Model read = llmt::from_json(llmt::to_json(result.model));
  Eigen::MatrixXd asked(7, 2);
  for (Eigen::Index i = 0; i < 7; ++i) asked.row(i) << (i == 6 ? missing : static_cast<double>(i + 1)), 0.5;
  const Eigen::VectorXd y = result.model.predict(asked).col(0);
  for (Eigen::Index i = 0; i < 7; ++i) EXPECT_NEAR(y(i), of_month[i] + 0.5, 0.2) << i;
  EXPECT_EQ(read.predict(asked).col(0), y);
}

// A weight of 0 leaves no trace: the only row without a word is none.
TEST(EmptyLevel, NeedsARowThatTakesPart) {
  llmt::TrainingData data = table(300);
  for (Eigen::Index i = 4; i < 300; i += 5) data.inputs(i, 0) = i == 4 ? missing : 0.0;
  data.weights = Eigen::VectorXd::Ones(300);
  data.weights(4) = 0.0;
  EXPECT_FALSE(llmt::fit(data).model.inputs()[0].has_empty_level());
  EXPECT_FALSE(llmt::fit_boosted(data).model.inputs()[0].has_empty_level());
}

}  // namespace
