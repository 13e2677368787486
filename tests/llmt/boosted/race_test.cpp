// Variants of the trees that a race takes, and those it does not.
#include "boosted/race.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"

namespace race_test {
namespace {

template <class Function>
llmt::TrainingData drawn(Eigen::Index rows, Eigen::Index inputs, std::uint64_t seed, const Function& function) {
  llmt::Random random(seed);
  llmt::TrainingData data;
  data.inputs.resize(rows, inputs);
  data.outputs.resize(rows, 1);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (double& value : data.inputs.row(i)) value = random.uniform();
    data.outputs(i, 0) = function(data.inputs, i) + 0.02 * random.normal();
  }
  return data;
}

// Six inputs of five values each, uneven steps of them and of their products.
llmt::TrainingData grid(Eigen::Index rows, std::uint64_t seed) {
  llmt::TrainingData data = drawn(rows, 6, seed, [](auto& x, Eigen::Index i) {
    for (double& value : x.row(i)) value = std::floor(5.0 * value);
    const auto above = [&](int input, double value) { return x(i, input) > value ? 1.0 : 0.0; };
    return above(0, 1.0) - 2.0 * above(1, 2.0) * above(2, 0.0) + 1.5 * above(3, 3.0) * above(0, 2.0) +
           0.7 * above(4, 1.0) - above(5, 0.0) * above(1, 0.0) * above(3, 1.0);
  });
  return data;
}

llmt::TrainingData curve(Eigen::Index rows, std::uint64_t seed) {
  return drawn(rows, 4, seed, [](const auto& x, Eigen::Index i) {
    return std::sin(4.0 * x(i, 0) * x(i, 1)) + std::exp(-6.0 * (x(i, 2) - 0.4) * (x(i, 2) - 0.4)) * x(i, 3);
  });
}

double error_on(const llmt::BoostResult& fitted, const llmt::TrainingData& fresh) {
  return llmt::rmse(fitted.model.predict(fresh.inputs), fresh.outputs)(0);
}

TEST(Race, TakesConstantsWhereTheTruthHasSteps) {
  const llmt::BoostResult fitted = llmt::fit_boosted(grid(900, 1));
  EXPECT_EQ(fitted.summaries[0].variant, "symmetric with constants");
  for (const llmt::BoostedTree& tree : fitted.model.sums()[0].trees) {
    EXPECT_TRUE(std::ranges::all_of(tree.leaves, [](const auto& leaf) { return leaf.slopes.empty(); }));
  }
  EXPECT_LT(error_on(fitted, grid(3000, 2)), 0.05);
}

TEST(Race, OfFewRowsTakesSoftTreesWhereTheTruthIsSmooth) {
  const llmt::BoostResult fitted = llmt::fit_boosted(curve(2500, 3));
  const auto& compared = fitted.summaries[0].compared;
  EXPECT_EQ(compared.front().name, "symmetric");
  const auto taken = std::ranges::find_if(compared, [](const auto& variant) { return variant.share > 0.0; });
  ASSERT_NE(taken, compared.end());
  EXPECT_TRUE(taken->name.starts_with("soft")) << taken->name;
  EXPECT_LT(error_on(fitted, curve(3000, 4)), 0.03);
}

// Where variants differ by chance alone the one without a name of its own stays.
TEST(Race, OfFewRowsKeepsSymmetricTreesWhereNothingIsProven) {
  const llmt::TrainingData noise = drawn(600, 3, 5, [](const auto& x, Eigen::Index i) {
    return x(i, 0) + 3.0 * std::sin(1e4 * x(i, 1));  // a function that no tree can follow
  });
  const llmt::BoostingData data = llmt::boosting_data(noise, {});
  const llmt::RoundOptions usual{
      .tree = {.depth = 4, .slopes = 3, .ridges = {3.0, 1.0}}, .rate = 0.05, .patience = 200};
  const llmt::Progress nobody;
  llmt::Work work(nobody);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const llmt::SumPlan plan = llmt::race(data, data.y.col(0), usual, seed, work);
    EXPECT_EQ(plan.name, "symmetric") << seed;
    EXPECT_GT(plan.compared.size(), 2U);
  }
}

}  // namespace
}  // namespace race_test
