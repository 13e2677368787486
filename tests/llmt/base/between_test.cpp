#include "base/between.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

namespace {

double above(double value) { return std::nextafter(value, std::numeric_limits<double>::infinity()); }

}  // namespace

TEST(Between, SeparatesAnyTwoNumbers) {
  constexpr double tiny = std::numeric_limits<double>::denorm_min();
  constexpr double huge = std::numeric_limits<double>::max();
  const double after_one = above(1.0);
  for (const auto& [low, high] : {std::pair{1.0, 2.0},
                                  {-1.0, 3.0},
                                  {1.0, after_one},
                                  {after_one, above(after_one)},
                                  {-above(after_one), -after_one},
                                  {0.0, tiny},
                                  {-tiny, 0.0},
                                  {-tiny, tiny},
                                  {tiny, 2.0 * tiny},
                                  {2.0 * tiny, 3.0 * tiny},
                                  {-1.0, tiny},
                                  {std::nextafter(huge, 0.0), huge},
                                  {-huge, -std::nextafter(huge, 0.0)},
                                  {0.5 * huge, huge},
                                  {-huge, huge}}) {
    EXPECT_LE(low, llmt::between(low, high)) << low << " " << high;
    EXPECT_LT(llmt::between(low, high), high) << low << " " << high;
  }
}

TEST(Between, IsTheMiddleWhereThereIsOne) {
  EXPECT_EQ(llmt::between(1.0, 2.0), 1.5);
  EXPECT_EQ(llmt::between(-1.0, 3.0), 1.0);
  EXPECT_EQ(llmt::between(0.5e308, 1.5e308), 1e308);
}
