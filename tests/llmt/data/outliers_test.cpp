#include "llmt/outliers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "llmt/random.hpp"

namespace {

Eigen::VectorXd normal_values(Eigen::Index count, double centre, double deviation) {
  llmt::Random random(1);
  Eigen::VectorXd values(count);
  for (double& value : values) value = centre + deviation * random.normal();
  return values;
}

TEST(Outliers, TheScaleOfNormalValuesIsTheirStandardDeviation) {
  const llmt::RobustScale scale = llmt::robust_scale(normal_values(20000, 7.0, 3.0));
  EXPECT_NEAR(scale.median, 7.0, 0.1);
  EXPECT_NEAR(scale.deviation, 3.0, 0.1);
}

TEST(Outliers, AMinorityDoesNotMoveMedianOrScale) {
  Eigen::VectorXd values = normal_values(1000, 0.0, 1.0);
  values.head(400).setConstant(1e9);
  const llmt::RobustScale scale = llmt::robust_scale(values);
  EXPECT_LT(std::abs(scale.median), 2.0);
  EXPECT_LT(scale.deviation, 5.0);
  EXPECT_THROW(llmt::robust_scale(Eigen::VectorXd()), std::invalid_argument);
}

TEST(Outliers, DominantRowsAreTheFarthestFirst) {
  Eigen::VectorXd values = normal_values(1000, 5.0, 1.0);
  values(17) = 1e4;
  values(3) = -2e4;
  const llmt::DominantRows dominant = llmt::dominant_rows(values);
  EXPECT_EQ(dominant.rows, (std::vector<Eigen::Index>{3, 17}));
  EXPECT_GT(dominant.share, 0.99);
  EXPECT_FALSE(dominant.hide_the_others);
}

TEST(Outliers, OrdinaryValuesAreNotDominant) {
  EXPECT_TRUE(llmt::dominant_rows(normal_values(1000, 5.0, 1.0)).rows.empty());
  EXPECT_TRUE(llmt::dominant_rows(Eigen::VectorXd::Constant(50, 3.0)).rows.empty());
  // Prices and sizes: a long tail that belongs to the data.
  EXPECT_TRUE(llmt::dominant_rows(normal_values(1000, 0.0, 1.0).array().exp().matrix()).rows.empty());
  // A rare event: more than half of the values agree.
  Eigen::VectorXd rare = Eigen::VectorXd::Zero(1000);
  rare.head(5).setConstant(1.0);
  EXPECT_TRUE(llmt::dominant_rows(rare).rows.empty());
  // Two per cent of the rows are more than a few.
  Eigen::VectorXd two_groups = normal_values(1000, 0.0, 1.0);
  two_groups.head(20).setConstant(1000.0);
  EXPECT_TRUE(llmt::dominant_rows(two_groups).rows.empty());
}

TEST(Outliers, AValueThatHidesTheOthersIsSaidToDoSo) {
  Eigen::VectorXd values = normal_values(100, 0.0, 1.0);
  values(42) = 1e15;
  EXPECT_FALSE(llmt::dominant_rows(values).hide_the_others);
  values(42) = -1e17;
  EXPECT_TRUE(llmt::dominant_rows(values).hide_the_others);
  values(42) = 1e150;  // whose square is not finite beside others
  EXPECT_TRUE(llmt::dominant_rows(values).hide_the_others);
  EXPECT_EQ(llmt::dominant_rows(values).share, 1.0);
}

TEST(DominantRows, OfFewRowsNoneIsSaidToCarryMost) {
  const auto dominant = [](Eigen::Index rows) {
    Eigen::VectorXd values = Eigen::VectorXd::LinSpaced(rows, 0.0, 1.0);
    values(1) = 100.0;
    return llmt::dominant_rows(values).rows.size();
  };
  EXPECT_EQ(dominant(3), 0u);
  EXPECT_EQ(dominant(9), 0u);
  EXPECT_EQ(dominant(40), 1u);
}

}  // namespace
