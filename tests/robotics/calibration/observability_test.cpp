#include "llmt/robotics/observability.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace llmt::robotics {
namespace {

TEST(Observability, IsThatOfTheDefinitions) {
  const Observability seen = observability(Eigen::Vector3d(8.0, 1.0, 4.0), 16);
  EXPECT_DOUBLE_EQ(seen.o1, std::cbrt(32.0) / 4.0);
  EXPECT_DOUBLE_EQ(seen.o2, 1.0 / 8.0);
  EXPECT_DOUBLE_EQ(seen.o3, 1.0);
  EXPECT_DOUBLE_EQ(seen.o4, 1.0 / 8.0);
  EXPECT_DOUBLE_EQ(seen.o5, 1.0 / (1.0 / 8.0 + 1.0 + 1.0 / 4.0));
  EXPECT_DOUBLE_EQ(seen.condition, 8.0);
  EXPECT_EQ(seen.parameters, 3);
}

TEST(Observability, IsNothingWhereAParameterIsNotSeen) {
  const Observability seen = observability(Eigen::Vector2d(1.0, 0.0), 4);
  EXPECT_EQ(seen.o1, 0.0);
  EXPECT_EQ(seen.o5, 0.0);
  EXPECT_EQ(seen.condition, std::numeric_limits<double>::infinity());
}

TEST(Observability, RefusesNoValuesNegativeOnesAndNoPoses) {
  EXPECT_THROW(observability(Eigen::VectorXd(), 1), std::invalid_argument);
  EXPECT_THROW(observability(Eigen::Vector2d(1.0, -1.0), 1), std::invalid_argument);
  EXPECT_THROW(observability(Eigen::Vector2d(1.0, std::nan("")), 1), std::invalid_argument);
  EXPECT_THROW(observability(Eigen::Vector2d(1.0, 1.0), 0), std::invalid_argument);
}

}  // namespace
}  // namespace llmt::robotics
