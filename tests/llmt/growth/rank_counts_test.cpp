// Splits whose children have different ranks: a regressor that is a step of another input is constant in both children
// of the split at the step, and has a coefficient of its own in a child that holds rows of both sides.
#include <gtest/gtest.h>

#include <cmath>

#include "growth/search/adjusted_rss.hpp"
#include "llmt/fit.hpp"
#include "oracles/oracles.hpp"

namespace {

// Inputs: u uniform in 0 ... 1 three times, and the step s = [u_0 > 0.5]. Two planes, one on either side of the step.
struct Steps {
  Eigen::MatrixXd x;
  Eigen::MatrixXd y;
};

Steps steps(Eigen::Index rows, double noise, std::uint64_t seed) {
  llmt::Random random(seed);
  Steps table{Eigen::MatrixXd(rows, 4), Eigen::MatrixXd(rows, 1)};
  table.x.leftCols(3) = 0.5 + 0.5 * oracle::firm(oracle::uniform(rows, 3, seed)).array();
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto u = table.x.row(i);
    const bool beyond = u(0) > 0.5;
    table.x(i, 3) = beyond ? 1.0 : 0.0;
    table.y(i, 0) = (beyond ? 3.0 - 2.0 * u(0) + u(1) : u(0) - u(1) + u(2)) + noise * random.normal();
  }
  return table;
}

struct Rule {
  llmt::GrowthRule rule;
  llmt::SplitSearch search;
};

const Rule rules[] = {{llmt::GrowthRule::rd, llmt::SplitSearch::exact},
                      {llmt::GrowthRule::rd, llmt::SplitSearch::binned},
                      {llmt::GrowthRule::retis, llmt::SplitSearch::exact},
                      {llmt::GrowthRule::retis, llmt::SplitSearch::binned}};

llmt::FitResult one_split(const Steps& table, const Rule& rule) {
  llmt::FitOptions options;
  options.rule = rule.rule;
  options.expert.search = rule.search;
  options.significance = 1.0;
  options.max_leaves = 2;
  options.validity = llmt::ValidityChoice::crisp;
  options.folds.count = 0;
  return llmt::fit(table.x, table.y, options);
}

// Whether the split is the one at the step, on whichever of the two inputs.
bool is_at_the_step(const Steps& table, const llmt::Node& root) {
  if (root.is_leaf()) return false;
  const auto goes_left = table.x.col(root.split_input).array() <= root.threshold;
  return (goes_left == (table.x.col(3).array() < 0.5)).all();
}

// The step is the only thing to find. Of a hundred other splits some leave less, with one coefficient more. By the RSS
// alone one of them is always found.
TEST(RankCounts, StepIsSplitWhereItIs) {
  for (const Rule& rule : rules) {
    for (const double noise : {0.001, 0.1}) {
      int at_the_step = 0;
      for (std::uint64_t seed = 1; seed <= 30; ++seed) {
        const Steps table = steps(rule.search == llmt::SplitSearch::binned ? 2500 : 300, noise, seed);
        const llmt::FitResult result = one_split(table, rule);
        at_the_step += is_at_the_step(table, result.model.partitions()[0].nodes[0]) ? 1 : 0;
      }
      EXPECT_GE(at_the_step, 24) << llmt::name_of(rule.rule) << " " << noise;
    }
  }
}

// Without noise the two planes are found, and what is wrong is only the gap between the rows on either side of the
// step.
TEST(RankCounts, TwoRowsDecideNoDirection) {
  for (const Rule& rule : rules) {
    for (std::uint64_t seed = 1; seed <= 30; ++seed) {
      SCOPED_TRACE(seed);
      const Steps table = steps(rule.search == llmt::SplitSearch::binned ? 2500 : 300, 0.0, seed);
      const llmt::FitResult result = one_split(table, rule);
      ASSERT_TRUE(is_at_the_step(table, result.model.partitions()[0].nodes[0]));
      EXPECT_LT((result.model.predict(table.x) - table.y).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

TEST(AdjustedRss, IsWhatIsLeftPerDegreeOfFreedom) {
  const llmt::AdjustedRss scale(100.0, 5, 7.0);
  EXPECT_EQ(scale.of(3.0, 10), 3.0);
  for (int ranks = 6; ranks < 10; ++ranks) {
    EXPECT_NEAR(scale.of(3.0, ranks), 3.0 / (100.0 - ranks) * 90.0, 1e-12);
  }
}

TEST(AdjustedRss, WithoutDegreesOfFreedomIsTheRss) {
  EXPECT_EQ(llmt::AdjustedRss(10.0, 5, 7.0).of(3.0, 9), 3.0);
  EXPECT_EQ(llmt::AdjustedRss(9.0, 5, 7.0).of(3.0, 9), 3.0);
}

// A child of few rows may lack a direction because it lacks rows.
TEST(AdjustedRss, RankCountsFromTwiceAsManyRowsOn) {
  const llmt::AdjustedRss scale(100.0, 5, 7.0);
  EXPECT_EQ(scale.counted(3, 9), 5);
  EXPECT_EQ(scale.counted(3, 10), 3);
}

}  // namespace
