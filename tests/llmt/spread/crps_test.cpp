// The score of quantiles against its closed forms.
#include "llmt/crps.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace {

// Of the uniform distribution on 0 ... 1 the CRPS is the integral of z^2 below y and of (1 - z)^2 above it.
TEST(Crps, OfAUniformForecast) {
  for (const int count : {20, 200}) {
    const std::vector<double> p = llmt::crps_probabilities(count);
    const Eigen::RowVectorXd quantiles = Eigen::Map<const Eigen::RowVectorXd>(p.data(), count);
    for (const double y : {0.0, 0.2, 0.5, 0.9, 1.0}) {
      const double exact = (std::pow(y, 3) + std::pow(1.0 - y, 3)) / 3.0;
      EXPECT_NEAR(llmt::crps(quantiles, Eigen::VectorXd::Constant(1, y))(0), exact, 0.5 / (count * count)) << y;
    }
    // Beyond 0 ... 1 by 2: the distance more.
    EXPECT_NEAR(llmt::crps(quantiles, Eigen::VectorXd::Constant(1, 3.0))(0), 1.0 / 3.0 + 2.0, 0.5 / (count * count));
  }
}

double normal_distribution(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

double normal_quantile(double p) {
  double low = -10.0;
  double high = 10.0;
  for (int k = 0; k < 100; ++k) {
    const double middle = 0.5 * (low + high);
    (normal_distribution(middle) < p ? low : high) = middle;
  }
  return low;
}

// Gneiting & Raftery 2007: s (z (2 Phi(z) - 1) + 2 phi(z) - 1 / sqrt(pi)), z = (y - m) / s.
TEST(Crps, OfANormalForecast) {
  const double mean = 3.0;
  const double sd = 2.0;
  const std::vector<double> p = llmt::crps_probabilities(1000);
  Eigen::MatrixXd quantiles(3, 1000);
  for (std::size_t k = 0; k < p.size(); ++k) {
    quantiles.col(static_cast<Eigen::Index>(k)).setConstant(mean + sd * normal_quantile(p[k]));
  }
  const Eigen::VectorXd scores = llmt::crps(quantiles, Eigen::Vector3d(3.0, 5.0, -2.0));
  for (Eigen::Index row = 0; row < 3; ++row) {
    const double z = (Eigen::Vector3d(3.0, 5.0, -2.0)(row) - mean) / sd;
    const double density = std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
    const double exact =
        sd * (z * (2.0 * normal_distribution(z) - 1.0) + 2.0 * density - 1.0 / std::sqrt(std::numbers::pi));
    EXPECT_NEAR(scores(row), exact, 2e-3 * exact) << row;
  }
}

TEST(Crps, OfACertainForecastIsTheAbsoluteError) {
  const Eigen::MatrixXd quantiles = Eigen::MatrixXd::Constant(2, 20, 4.0);
  EXPECT_TRUE(llmt::crps(quantiles, Eigen::Vector2d(1.0, 6.0)).isApprox(Eigen::Vector2d(3.0, 2.0), 1e-12));
  EXPECT_THROW(llmt::crps(quantiles, Eigen::VectorXd::Ones(3)), std::invalid_argument);
  EXPECT_THROW(llmt::crps(Eigen::MatrixXd(2, 0), Eigen::VectorXd::Ones(2)), std::invalid_argument);
}

}  // namespace
