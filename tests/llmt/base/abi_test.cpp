#include "llmt/abi.hpp"

#include <gtest/gtest.h>

// That this binary links at all is the claim; a mismatch is tested in tests/abi.
TEST(Abi, LibraryAndUserAgreeOnAlignment) { EXPECT_NE(llmt::abi::tag, nullptr); }
