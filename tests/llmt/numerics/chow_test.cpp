// Chow's test against tabulated quantiles of the F distribution.
#include <gtest/gtest.h>

#include "numerics/f_distribution.hpp"

namespace {

TEST(Chow, PValueIsThatOfTheTabulatedQuantiles) {
  // Upper 5 % and 1 % points of F(2, 10), F(1, 5) and F(5, 20), to the digits of the tables.
  EXPECT_NEAR(llmt::chow_p_value(2.0 * 4.1028, 2.0, 1.0, 10.0), 0.05, 1e-5);
  EXPECT_NEAR(llmt::chow_p_value(3.0 * 16.258, 1.0, 3.0, 5.0), 0.01, 1e-5);
  EXPECT_NEAR(llmt::chow_p_value(5.0 * 0.25 * 2.7109, 5.0, 0.25, 20.0), 0.05, 1e-5);
}

TEST(Chow, NoGainIsNoEvidenceAndAPerfectFitIsAll) {
  EXPECT_EQ(llmt::chow_p_value(0.0, 2.0, 1.0, 10.0), 1.0);
  EXPECT_EQ(llmt::chow_p_value(-1e-9, 2.0, 1.0, 10.0), 1.0);
  EXPECT_EQ(llmt::chow_p_value(1.0, 2.0, 0.0, 10.0), 0.0);
}

}  // namespace
