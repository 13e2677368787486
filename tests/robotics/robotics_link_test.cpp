#include "llmt/robotics/robotics.hpp"

#include <gtest/gtest.h>

// That this binary links at all is the claim; a mismatch is tested in tests/abi.
TEST(Robotics, LibraryAndUserAgreeOnAlignment) { EXPECT_NE(llmt::abi::tag, nullptr); }
