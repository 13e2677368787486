// The memory that a fit will take.
#include "fit/plan/memory.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "llmt/stream.hpp"
#include "oracles/thrown.hpp"

namespace {

TEST(FitMemory, WhatIsBeyondTheMachineIsRefusedWithTheNumbers) {
  // 8 (8 n (d + p + o) + 16 p^2) = 8 (8 500 4002 + 16 2001^2) bytes, 0.64 GB.
  const llmt::FitSize wide{
      .rows = 500, .inputs = 2000, .outputs = 1, .coefficients = 2001, .unknowns = 0, .threads = 2};
  EXPECT_NEAR(llmt::estimated_memory(wide), 8.0 * (8.0 * 500 * 4002 + 16.0 * 2001 * 2001), 1.0);
  EXPECT_NO_THROW(llmt::refuse_beyond_memory(wide, 1'000'000'000));
  const std::string message =
      oracle::thrown<std::runtime_error>([&] { llmt::refuse_beyond_memory(wide, 500'000'000); });
  EXPECT_NE(message.find("500 rows with 2000 inputs need about 0.6 GB of memory, this machine has 0.5 GB"),
            std::string::npos)
      << message;
}

// What cannot be had by a stream or fewer leaves is not advised, and a stream says so before its first row.
TEST(FitMemory, TooManyInputsAreTooManyForAStream) {
  const llmt::FitSize wide{
      .rows = 500, .inputs = 2000, .outputs = 1, .coefficients = 2001, .unknowns = 0, .threads = 1};
  const auto message = [&](std::uintmax_t memory) {
    return oracle::thrown<std::runtime_error>([&] { llmt::refuse_beyond_memory(wide, memory); });
  };
  EXPECT_TRUE(message(550'000'000).ends_with("take fewer inputs or a lower limit of leaves, or fit a stream"));
  EXPECT_TRUE(message(500'000'000).ends_with("this machine has 0.5 GB; take fewer inputs")) << message(500'000'000);
  const std::string of_stream = oracle::thrown<std::runtime_error>([] { llmt::Stream(1'000'000, 1); });
  EXPECT_TRUE(of_stream.starts_with("1000000 inputs need about 128000.3 GB of memory")) << of_stream;
}

TEST(FitMemory, JointSystemsCountForEveryThread) {
  const llmt::FitSize one{
      .rows = 1000, .inputs = 100, .outputs = 1, .coefficients = 101, .unknowns = 300 * 101, .threads = 1};
  llmt::FitSize four = one;
  four.threads = 4;
  EXPECT_NEAR(llmt::estimated_memory(four) - llmt::estimated_memory(one), 8.0 * 9.0 * 30300 * 30300, 1.0);
  const std::string message =
      oracle::thrown<std::runtime_error>([&] { llmt::refuse_beyond_memory(one, 1'000'000'000); });
  EXPECT_NE(message.find("1000 rows with 100 inputs and 300 leaves"), std::string::npos) << message;
}

}  // namespace
