// Tests of two samples against enumerations and textbook figures.
#include "numerics/two_samples.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "llmt/random.hpp"

namespace {

using llmt::CountedSample;

// Lepage's statistic with the covariance over all ways to choose the second sample, by enumeration.
double lepage_by_enumeration(const std::vector<double>& all, std::size_t fresh) {
  const std::size_t count = all.size();
  std::vector<Eigen::Vector2d> scores;
  for (const double value : all) {
    double rank = 0.5;
    for (const double other : all) rank += other < value ? 1.0 : other == value ? 0.5 : 0.0;
    scores.emplace_back(rank, std::abs(rank - 0.5 * static_cast<double>(count + 1)));
  }
  const auto difference = [&](unsigned chosen) {
    Eigen::Vector2d in = Eigen::Vector2d::Zero();
    Eigen::Vector2d out = Eigen::Vector2d::Zero();
    for (std::size_t k = 0; k < count; ++k) ((chosen >> k & 1U) != 0 ? in : out) += scores[k];
    return Eigen::Vector2d(in / static_cast<double>(fresh) - out / static_cast<double>(count - fresh));
  };
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  double ways = 0.0;
  for (unsigned chosen = 0; chosen < 1U << count; ++chosen) {
    if (static_cast<std::size_t>(__builtin_popcount(chosen)) != fresh) continue;
    const Eigen::Vector2d d = difference(chosen);
    covariance += d * d.transpose();  // their mean is 0
    ways += 1.0;
  }
  const Eigen::Vector2d d = difference((1U << fresh) - 1U);
  return d.dot((covariance / ways).inverse() * d);
}

TEST(TwoSamples, LepageHasTheCovarianceOfAllOrders) {
  const std::vector<double> fresh = {3.0, 1.0, 7.0, 7.0};
  const std::vector<double> known = {1.0, 2.0, 3.0, 4.0, 5.5};  // 3 occurs twice
  const std::vector<Eigen::Index> counts = {1, 1, 2, 1, 1};
  const double expected = lepage_by_enumeration({3.0, 1.0, 7.0, 7.0, 1.0, 2.0, 3.0, 3.0, 4.0, 5.5}, 4);
  EXPECT_NEAR(llmt::same_numbers_probability({known, counts}, fresh), std::exp(-0.5 * expected), 1e-12);
}

TEST(TwoSamples, EqualValuesAndEmptySamplesSayNothing) {
  const std::vector<double> one = {2.0};
  const std::vector<Eigen::Index> ten = {10};
  EXPECT_EQ(llmt::same_numbers_probability({one, ten}, {2.0, 2.0}), 1.0);
  EXPECT_EQ(llmt::same_numbers_probability({one, ten}, {}), 1.0);
  EXPECT_EQ(llmt::same_shares_probability({5, 5}, {0, 0}), 1.0);
  EXPECT_EQ(llmt::same_share_probability(0, 5, 0, 5), 1.0);
}

TEST(TwoSamples, LepageFindsAShiftAndASpreadAndKeepsItsLevel) {
  llmt::Random random(3);
  int said = 0;
  constexpr int draws = 500;
  for (int draw = 0; draw < draws; ++draw) {
    std::vector<double> known;
    std::vector<double> fresh;
    for (int k = 0; k < 60; ++k) known.push_back(std::round(4.0 * random.normal()) + 1e-6 * k);
    for (int k = 0; k < 40; ++k) fresh.push_back(std::round(4.0 * random.normal()));
    std::ranges::sort(known);
    const std::vector<Eigen::Index> once(known.size(), 1);
    said += llmt::same_numbers_probability({known, once}, fresh) < 0.05 ? 1 : 0;
    if (draw > 0) continue;
    for (double& value : fresh) value += 8.0;
    EXPECT_LT(llmt::same_numbers_probability({known, once}, fresh), 1e-6);
    for (double& value : fresh) value = 4.0 * (value - 8.0);
    EXPECT_LT(llmt::same_numbers_probability({known, once}, fresh), 1e-3);
  }
  EXPECT_NEAR(said, 25, 15);  // of 500 at 5 %: three standard deviations
}

TEST(TwoSamples, ChiSquareIsThatOfATable) {
  // 20 of 60 and 40 of 60: 13.333 with one degree of freedom, p 0.000261.
  EXPECT_NEAR(llmt::same_shares_probability({20, 40}, {40, 20}), 0.00026073, 1e-7);
  // A category with one row is joined with another one: two are left.
  EXPECT_NEAR(llmt::same_shares_probability({20, 40, 0}, {40, 19, 1}), 0.00026073, 1e-7);
  EXPECT_EQ(llmt::same_shares_probability({3, 2}, {2, 3}), 1.0);
}

TEST(TwoSamples, FishersTeaTasting) {
  // 3 of 4 against 1 of 4: the tail is 17 / 70.
  EXPECT_NEAR(llmt::same_share_probability(1, 4, 3, 4), 2.0 * 17.0 / 70.0, 1e-12);
  EXPECT_NEAR(llmt::same_share_probability(0, 4, 4, 4), 2.0 / 70.0, 1e-12);
}

TEST(TwoSamples, ValuesBeyondTheLargest) {
  EXPECT_NEAR(llmt::beyond_largest_probability(1, 1, 9), 0.1, 1e-15);
  EXPECT_NEAR(llmt::beyond_largest_probability(2, 2, 3), 2.0 / 5.0 * 1.0 / 4.0, 1e-15);
  EXPECT_EQ(llmt::beyond_largest_probability(0, 5, 9), 1.0);
  // Rows outside of what leaves one of the known outside are those above the largest but none: the same law.
  for (const Eigen::Index count : {1, 2, 5}) {
    EXPECT_NEAR(llmt::outside_probability(count, 7, 1, 19), llmt::beyond_largest_probability(count, 7, 19), 1e-12);
  }
  EXPECT_NEAR(llmt::outside_probability(0, 30, 3, 40), 1.0, 1e-9);
}

TEST(TwoSamples, PermutationsOfAMean) {
  // The two largest of five: one of ten choices.
  EXPECT_NEAR(llmt::larger_mean_probability({0.0, 1.0, 2.0}, {5.0, 6.0}), 0.1, 0.015);
  EXPECT_NEAR(llmt::larger_mean_probability({5.0, 6.0}, {0.0, 1.0, 2.0}), 1.0, 1e-12);
  EXPECT_NEAR(llmt::larger_mean_probability({1.0, 5.0}, {0.0, 6.0, 4.0}), 0.6, 0.03);
  EXPECT_EQ(llmt::larger_mean_probability({}, {1.0}), 1.0);
}

TEST(TwoSamples, ManyRowsAreJudgedByTheNormalDistribution) {
  llmt::Random random(5);
  std::vector<double> one;
  std::vector<double> other;
  for (int k = 0; k < 25000; ++k) {
    one.push_back(random.normal());
    other.push_back(random.normal() + 0.02);  // 0.02 sqrt(12500) = 2.24 standard errors
  }
  const double p = llmt::larger_mean_probability(one, other);
  EXPECT_GT(p, 1e-4);
  EXPECT_LT(p, 0.35);
  EXPECT_GT(llmt::larger_mean_probability(other, one), 0.65);
}

TEST(TwoSamples, HolmCountsTheTests) {
  const std::vector<double> corrected = llmt::holm({0.01, std::nan(""), 0.04, 0.03, 0.5});
  EXPECT_DOUBLE_EQ(corrected[0], 0.04);
  EXPECT_TRUE(std::isnan(corrected[1]));
  EXPECT_DOUBLE_EQ(corrected[2], 0.09);  // not below that of 0.03, which is 3 x 0.03
  EXPECT_DOUBLE_EQ(corrected[3], 0.09);
  EXPECT_DOUBLE_EQ(corrected[4], 0.5);
}

}  // namespace
