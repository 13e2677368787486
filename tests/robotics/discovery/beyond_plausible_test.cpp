// What is said of an effect that was refused for its size.
#include <gtest/gtest.h>

#include "discovery/judges/findings.hpp"
#include "robotics/effects.hpp"

namespace llmt::robotics {
namespace {

std::vector<BeyondPlausible> said_of_half_width(double half_width) {
  Investigation investigation;
  investigation.implausible["hysteresis at joint2"] = {"hysteresis", "joint2", {half_width}};
  return beyond_plausible(investigation, ur_like());
}

TEST(BeyondPlausible, IsASizeAndNotAValueThatOthersCancel) {
  const std::vector<BeyondPlausible> said = said_of_half_width(0.005);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_EQ(said[0].parameter.value, 0.005);
  EXPECT_EQ(said[0].limit, 0.003);
  EXPECT_TRUE(said_of_half_width(0.002).empty());
  EXPECT_TRUE(said_of_half_width(0.8).empty());
  EXPECT_TRUE(said_of_half_width(-0.001).empty());  // a limit of the sign
}

}  // namespace
}  // namespace llmt::robotics
