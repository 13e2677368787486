#include "numerics/chebyshev.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "llmt/random.hpp"

namespace {

// A polynomial by its zeros, times `factor`.
double value_at(double x, const std::vector<double>& zeros, double factor) {
  for (const double zero : zeros) factor *= x - zero;
  return factor;
}

Eigen::VectorXd coefficients_of(int degree, const std::vector<double>& zeros, double factor, double level) {
  const std::vector<double> points = llmt::chebyshev_points(degree);
  Eigen::VectorXd values(degree + 1);
  for (int k = 0; k <= degree; ++k) values(k) = value_at(points[k], zeros, factor) + level;
  return llmt::chebyshev_coefficients(values);
}

TEST(Chebyshev, FindsTheZerosThatAPolynomialWasMadeOf) {
  llmt::Random random(4);
  for (int trial = 0; trial < 300; ++trial) {
    const int inside = trial % 7;
    std::vector<double> zeros;
    for (int k = 0; k < inside; ++k) zeros.push_back((k + random.uniform(0.2, 0.8)) / inside);
    std::vector<double> all = zeros;
    for (int k = 0; k < trial % 3; ++k) all.push_back(random.uniform(1.2, 3.0));
    // With points for a higher degree too.
    const int degree = static_cast<int>(all.size()) + trial % 4;
    const double factor = random.uniform(0.5, 2.0) * (trial % 2 == 0 ? 1.0 : -100.0);
    const double level = random.uniform(-3.0, 3.0);
    const std::vector<double> found = llmt::positions_of_level(coefficients_of(degree, all, factor, level), level);
    ASSERT_EQ(found.size(), zeros.size()) << trial;
    for (std::size_t k = 0; k < zeros.size(); ++k) EXPECT_NEAR(found[k], zeros[k], 1e-9) << trial;
  }
}

TEST(Chebyshev, FindsNothingWhereThereIsNothing) {
  EXPECT_TRUE(llmt::positions_of_level(coefficients_of(4, {0.2, 0.7}, 1.0, 0.0), 5.0).empty());
  EXPECT_TRUE(llmt::positions_of_level(coefficients_of(4, {0.2, 0.7}, 1.0, 0.0), -1.0).empty());  // below its minimum
  EXPECT_TRUE(llmt::positions_of_level(coefficients_of(4, {}, 2.0, 0.0), 2.0).empty());           // constant
  EXPECT_TRUE(llmt::positions_of_level(coefficients_of(4, {1.5}, 1.0, 0.0), 0.0).empty());        // beyond the end
  EXPECT_TRUE(
      llmt::positions_of_level(coefficients_of(4, {0.5}, 1.0, 0.0), std::numeric_limits<double>::infinity()).empty());
}

}  // namespace
