// The memory that a sum of trees will take.
#include <gtest/gtest.h>

#include <stdexcept>

#include "boosted/memory.hpp"
#include "oracles/thrown.hpp"

namespace {

TEST(SumMemory, WhatIsBeyondTheMachineIsRefusedWithTheNumbers) {
  // 8 n (6 (d + o) + 2 l) bytes, 0.34 GB.
  const llmt::SumSize size{.rows = 100'000, .inputs = 3, .outputs = 1, .levels = 200};
  EXPECT_NEAR(llmt::estimated_memory(size), 8.0 * 100'000 * (6.0 * 4 + 2.0 * 200), 1.0);
  EXPECT_NO_THROW(llmt::refuse_beyond_memory(size, 350'000'000));
  const std::string message =
      oracle::thrown<std::runtime_error>([&] { llmt::refuse_beyond_memory(size, 300'000'000); });
  EXPECT_TRUE(
      message.starts_with("a sum of trees of 100000 rows with 3 inputs and 200 levels of categories needs "
                          "about 0.3 GB of memory, this machine has 0.3 GB; take fewer rows"))
      << message;
}

}  // namespace
