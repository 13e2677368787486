// What a fit says of how far it is.
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "fit/fit_terms.hpp"
#include "oracles/oracles.hpp"

namespace {

struct At {
  double share;
  double operations;
};

// A fit with default options.
std::vector<At> watched_fit(Eigen::Index rows, Eigen::Index inputs, int threads) {
  const Eigen::MatrixXd x = oracle::uniform(rows, inputs, 7);
  std::vector<At> at;
  llmt::fit_terms(x, oracle::curved(x, 0.1), {.max_threads = threads}, {}, [&](double share, double operations) {
    at.push_back({share, operations});
  });
  return at;
}

// Between two reports no more than a fifth of the operations are done.
void expect_no_silence(const std::vector<At>& at) {
  At before{0.0, 0.0};
  for (const At& each : at) {
    EXPECT_GE(each.share, before.share);
    EXPECT_LE((each.operations - before.operations) / at.back().operations, 0.2);
    before = each;
  }
  EXPECT_GE(before.share, 0.95);
}

// What is still to come is not known before it is known how large the trees are that pay. Where large ones pay, as
// here, the share is right within a third; where they do not, it rises late.
TEST(Progress, TheShareOfADefaultFitIsThatOfTheOperationsWithinAThird) {
  for (const auto& [rows, inputs] :
       {std::pair(400, 4), std::pair(3000, 3)}) {  // with the choice of inputs, and without
    const std::vector<At> at = watched_fit(rows, inputs, 1);
    for (const At& each : at) EXPECT_NEAR(each.share, each.operations / at.back().operations, 1.0 / 3.0) << rows;
    expect_no_silence(at);
  }
}

TEST(Progress, NoStageOfAFitOnManyRowsIsSilent) { expect_no_silence(watched_fit(50000, 3, 1)); }

TEST(Progress, TheOperationsAreTheSameOnAnyNumberOfThreads) {
  const double of_one = watched_fit(400, 4, 1).back().operations;
  EXPECT_NEAR(watched_fit(400, 4, 3).back().operations, of_one, 1e-9 * of_one);  // added in another order
}

TEST(Progress, WhatIsReportedRisesAndEndsAtTheTotal) {
  const Eigen::MatrixXd x = oracle::uniform(300, 2, 8);
  Eigen::MatrixXd y(300, 2);
  y << oracle::curved(x, 0.1), oracle::curved(x, 0.2);
  for (const llmt::LocalTerms terms : {llmt::LocalTerms::linear, llmt::LocalTerms::automatic}) {
    for (const llmt::GrowthRule rule : {llmt::GrowthRule::rd, llmt::GrowthRule::lolimot}) {
      std::vector<double> shares = {0.0};
      llmt::FitOptions options{.rule = rule, .terms = terms};
      options.progress = [&](Eigen::Index done, Eigen::Index total) {
        shares.push_back(static_cast<double>(done) / static_cast<double>(total));
      };
      llmt::fit(x, y, options);
      EXPECT_TRUE(std::ranges::is_sorted(shares));
      EXPECT_EQ(shares.back(), 1.0);
      EXPECT_EQ(std::ranges::count(shares, 1.0), 1);
      EXPECT_GE(shares.size(), 20U);
    }
  }
}

}  // namespace
