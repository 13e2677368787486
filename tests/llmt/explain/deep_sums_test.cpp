// Contributions to sums whose trees are as deep as a file may hold them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "llmt/boosted_explain.hpp"
#include "llmt/limits.hpp"
#include "oracles/coalitions.hpp"
#include "oracles/hard_sums.hpp"
#include "oracles/oracles.hpp"
#include "oracles/thrown.hpp"

namespace {

using oracle::chain_of_sum;
using oracle::ChainOfSum;
using oracle::counting_leaf;

// The share that a split of a chain of ChainOfSum hands on to the next one.
long double share_of_next(int k, double x, double half_width) {
  const long double u = (static_cast<long double>(x) - 0.1 * (k % 5 - 2)) / half_width;
  return 0.5L - u * (3.0L - u * u) / 4.0L;
}

// What a chain to the left without slopes predicts for a row within all transitions.
long double prediction_of_chain(const ChainOfSum& chain, const Eigen::VectorXd& x) {
  long double share = 1.0L;
  long double sum = 0.0L;
  for (int k = 0; k <= chain.splits; ++k) {
    const long double next = k < chain.splits ? share_of_next(k, x(k % chain.inputs), chain.half_width) : 0.0L;
    sum += share * (1.0L - next) * (0.3L * (k % 7) - 0.9L);
    share *= next;
  }
  return 0.5L + 0.1L * sum;
}

// Contributions of such a chain with a split for each input. The coefficients of a leaf's polynomial in the number of
// inputs of the row, all inputs but one, are weighted by how many orders have so many before that one.
Eigen::VectorXd by_coefficients(const ChainOfSum& chain, const Eigen::VectorXd& x, const Eigen::VectorXd& background) {
  const int n = chain.splits;
  Eigen::VectorXd contributions = Eigen::VectorXd::Zero(n);
  for (int leaf = 0; leaf <= n; ++leaf) {
    const auto factor = [&](int k, const Eigen::VectorXd& row) {
      const long double next = share_of_next(k, row(k), chain.half_width);
      return k < leaf ? next : 1.0L - next;
    };
    const int used = std::min(leaf + 1, n);
    for (int i = 0; i < used; ++i) {
      std::vector<long double> coefficients = {1.0L};
      for (int k = 0; k < used; ++k) {
        if (k == i) continue;
        std::vector<long double> longer(coefficients.size() + 1, 0.0L);
        for (std::size_t s = 0; s < coefficients.size(); ++s) {
          longer[s] += coefficients[s] * factor(k, background);
          longer[s + 1] += coefficients[s] * factor(k, x);
        }
        coefficients = std::move(longer);
      }
      long double sum = 0.0L;
      long double weight = 1.0L / used;  // s! (used - s - 1)! / used!
      for (int s = 0; s < used; ++s) {
        sum += weight * coefficients[s];
        weight *= (s + 1.0L) / (used - 1.0L - s);
      }
      contributions(i) +=
          static_cast<double>(0.1L * (0.3L * (leaf % 7) - 0.9L) * sum * (factor(i, x) - factor(i, background)));
    }
  }
  return contributions;
}

TEST(DeepSums, AreSoDeepAndNoDeeper) {
  const int most_splits = static_cast<int>(llmt::most(llmt::Limit::model_splits_above_leaf));
  for (const bool to_the_left : {true, false}) {
    EXPECT_NO_THROW(chain_of_sum({.splits = most_splits, .to_the_left = to_the_left}));
    EXPECT_EQ(oracle::thrown([&] { chain_of_sum({.splits = most_splits + 1, .to_the_left = to_the_left}); }),
              "llmt::BoostedModel: sums/0/trees/0/splits/2000: the tree is deeper than 2000 splits");
  }
}

TEST(DeepSums, HaveSoManyLevelsOfAnInputAndNoMore) {
  const auto with_levels = [](int count) {
    llmt::InputColumn input{.name = "kind"};
    for (int k = 0; k < count; ++k) input.levels.push_back(std::to_string(k));
    return llmt::BoostedModel({input}, {{.name = "y"}}, {1.0}, {{}});
  };
  EXPECT_EQ(with_levels(10000).inputs()[0].levels.size(), 10000);
  EXPECT_EQ(oracle::thrown([&] { with_levels(10001); }),
            "llmt::BoostedModel: inputs/0: 10001 levels, at most 10000 are possible");
}

TEST(DeepSums, ArePredictedAsTheirFormulaSays) {
  const ChainOfSum chain{.splits = 2000, .inputs = 3, .half_width = 60.0};
  const llmt::BoostedModel model = chain_of_sum(chain);
  const Eigen::MatrixXd x = 3.0 * oracle::uniform(300, 3, 1);  // more rows than one block has
  const Eigen::VectorXd predicted = model.predict(x).col(0);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    EXPECT_NEAR(predicted(i), static_cast<double>(prediction_of_chain(chain, x.row(i).transpose())), 1e-14);
  }
}

TEST(DeepSums, OfOneInputHaveItsWholeChangeAsContribution) {
  const llmt::BoostedModel model = chain_of_sum({.splits = 2000, .inputs = 1, .half_width = 60.0, .slope = 0.1});
  const Eigen::MatrixXd x = 3.0 * oracle::uniform(4, 1, 2);
  const llmt::Attribution found = llmt::attribute(model, x.row(0).transpose(), x.bottomRows(3));
  EXPECT_NEAR(found.contributions(0, 0), found.prediction(0) - found.reference(0), 1e-14);
  EXPECT_GT(std::abs(found.contributions(0, 0)), 1e-3);
}

TEST(DeepSums, OfTwelveInputsHaveTheirShapleyValues) {
  Eigen::MatrixXd rows = 4.0 * oracle::uniform(5, 12, 3);
  rows.row(1) *= 5.0;  // beyond transitions
  rows(2, 4) = std::numeric_limits<double>::quiet_NaN();
  rows(4, 7) = std::numeric_limits<double>::quiet_NaN();
  rows(4, 2) = rows(0, 2);
  for (const double smallest_share : {0.0, 1e-3, 0.08, 0.2}) {
    for (const double slope : {0.0, 0.02, 0.3}) {
      for (const int together : {1, 2, 3}) {
        const llmt::BoostedModel model =
            chain_of_sum({.splits = 18, .smallest_share = smallest_share, .together = together, .slope = slope});
        double largest = 0.0;
        for (const int row : {0, 1, 2}) {
          const Eigen::VectorXd x = rows.row(row).transpose();
          const Eigen::MatrixXd expected = oracle::by_all_coalitions(model, x, rows.bottomRows(2));
          const Eigen::MatrixXd found = llmt::attribute(model, x, rows.bottomRows(2)).contributions;
          EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-14)
              << "smallest_share " << smallest_share << ", slope " << slope << ", together " << together << ", row "
              << row;
          largest = std::max(largest, expected.cwiseAbs().maxCoeff());
        }
        EXPECT_GT(largest, 1e-4);
      }
    }
  }
}

TEST(DeepSums, OfManyInputsHaveTheirShapleyValues) {
  for (const int n : {24, 40, 90}) {
    const ChainOfSum chain{.splits = n, .inputs = n};
    const Eigen::MatrixXd rows = 2.0 * oracle::uniform(2, n, 4);
    const Eigen::MatrixXd found =
        llmt::attribute(chain_of_sum(chain), rows.row(0).transpose(), rows.bottomRows(1)).contributions;
    const Eigen::VectorXd expected = by_coefficients(chain, rows.row(0).transpose(), rows.row(1).transpose());
    EXPECT_LT((found.row(0).transpose() - expected).cwiseAbs().maxCoeff(), 1e-15) << n;
    EXPECT_GT(expected.cwiseAbs().maxCoeff(), 1e-3);
  }
}

TEST(DeepSums, OfTwoThousandInputsAddUp) {
  const llmt::BoostedModel model = chain_of_sum({.splits = 2000, .inputs = 2000, .half_width = 60.0, .slope = 0.1});
  const Eigen::MatrixXd x = 3.0 * oracle::uniform(2, 2000, 5);
  const llmt::Attribution found = llmt::attribute(model, x.row(0).transpose(), x.bottomRows(1));
  EXPECT_NEAR(found.contributions.sum(), found.prediction(0) - found.reference(0), 1e-13);
}

TEST(DeepSums, TakeSoManyTrialsAndNoMore) {
  ASSERT_EQ(llmt::most(llmt::Limit::sum_trials), 10000);
  for (const int n : {12, 14}) {  // 1715 and 6434 trials
    const Eigen::RowVectorXd shares =
        llmt::attribute(counting_leaf(n), Eigen::VectorXd::Ones(n), Eigen::MatrixXd::Zero(1, n)).contributions;
    EXPECT_LT((shares.array() - 0.2 / n).abs().maxCoeff(), 1e-14) << n;
  }
  const std::string message = oracle::thrown(  // 11 439 trials
      [&] { llmt::attribute(counting_leaf(15), Eigen::VectorXd::Ones(15), Eigen::MatrixXd::Zero(1, 15)); });
  EXPECT_EQ(message.substr(0, message.find(" of an input")), "llmt::attribute: sums/0/trees/0: more than 10000 trials");
}

TEST(DeepSums, AreExplainedUntilStoppedWithinARow) {
  const llmt::BoostedModel model = chain_of_sum({.splits = 2000, .inputs = 40, .half_width = 60.0});
  const Eigen::MatrixXd x = oracle::uniform(4, 40, 7);
  int reports = 0;
  const llmt::Progress stop = [&](const llmt::ProgressReport&) { return ++reports < 4; };
  EXPECT_THROW(llmt::attribute_rows(model, x.topRows(1), x.bottomRows(1), 1, stop), llmt::Cancelled);
  EXPECT_EQ(reports, 4);
}

}  // namespace
