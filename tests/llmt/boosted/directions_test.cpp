// Features in the directions in which a sum of trees changes most.
#include "boosted/directions.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "llmt/boosted.hpp"
#include "llmt/random.hpp"

namespace {

// Inputs from -1 to 1. The output changes with two sums of them, by much and by little; x4 does nothing.
constexpr double strong[] = {0.6, -0.64, 0.48, 0.0, 0.0};
constexpr double weak[] = {0.8, 0.48, -0.36, 0.0, 0.0};

llmt::TrainingData turned(Eigen::Index rows, std::uint64_t seed) {
  llmt::Random random(seed);
  llmt::TrainingData data{.inputs = Eigen::MatrixXd(rows, 5), .outputs = Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    double along = 0.0;
    double across = 0.0;
    for (int j = 0; j < 5; ++j) {
      data.inputs(i, j) = random.uniform(-1.0, 1.0);
      along += strong[j] * data.inputs(i, j);
      across += weak[j] * data.inputs(i, j);
    }
    data.outputs(i, 0) = std::sin(4.0 * along) + 0.3 * across * across + 0.2 * data.inputs(i, 3);
  }
  return data;
}

TEST(Directions, AreThoseInWhichTheSumChangesMost) {
  const llmt::BoostingData data = llmt::boosting_data(turned(3000, 1), {});
  llmt::Random random(1);
  llmt::Work work{llmt::Progress{}};
  const llmt::Rounds rounds = llmt::boost(data.rows, data.y.col(0), llmt::all_rows(3000), {}, {},
                                          {.tree = {.depth = 5}, .rate = 0.3, .most_rounds = 50}, random, work);
  std::vector<int> inputs;
  for (const int column : {0, 1, 2, 3, 4}) {
    inputs.push_back(static_cast<int>(std::ranges::find(data.columns, column) - data.columns.begin()));
  }
  const std::vector<llmt::BoostedFeature> found = llmt::directions_of(rounds.trees, data.rows, data, inputs);
  ASSERT_FALSE(found.empty());
  Eigen::VectorXd factors = Eigen::VectorXd::Zero(5);
  for (std::size_t k = 0; k < found[0].inputs.size(); ++k) {
    factors(data.columns[found[0].inputs[k]]) = found[0].factors[k];
  }
  EXPECT_NEAR(factors.norm(), 1.0, 0.01);
  const double cosine = factors.dot(Eigen::Map<const Eigen::VectorXd>(strong, 5));
  EXPECT_GT(std::abs(cosine), 0.99) << factors.transpose();
  for (const llmt::BoostedFeature& direction : found) {
    EXPECT_GT(direction.inputs.size(), 1U);
    for (std::size_t k = 0; k < direction.factors.size(); ++k) {
      EXPECT_EQ(direction.factors[k], std::round(1000.0 * direction.factors[k]) / 1000.0);
      if (k > 0) {
        EXPECT_LE(std::abs(direction.factors[k]), std::abs(direction.factors[k - 1]));
      }
    }
    EXPECT_GT(direction.factors.front(), 0.0);
  }
}

TEST(Directions, WinTheRaceWhereTheOutputChangesAlongThem) {
  const llmt::TrainingData data = turned(5600, 2);
  const llmt::TrainingData fresh = turned(2000, 3);
  const llmt::BoostResult result = llmt::fit_boosted(data, {.max_rounds = 150});
  EXPECT_EQ(result.summaries[0].variant, "soft with directions");
  const Eigen::VectorXd errors = result.model.predict(fresh.inputs).col(0) - fresh.outputs.col(0);
  EXPECT_LT(std::sqrt(errors.cwiseAbs2().mean()), 0.021);  // 0.027 without them
}

}  // namespace
