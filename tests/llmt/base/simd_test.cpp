// Eight numbers side by side, in vectors of any width.
#include "base/simd.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

namespace {

using Numbers = std::array<double, 8>;
constexpr Numbers of_left = {1.0, -2.0, 0.1, 4e300, 0.0, 7.0, -0.3, 9.0};
constexpr Numbers of_right = {3.0, -0.7, 0.1, 5e-300, 2.0, -7.0, 11.0, 8.0};

// Numbers and results lie at addresses that no vector is aligned to.
template <int bytes>
std::vector<double> results_of() {
  using Eight = llmt::Eight<bytes>;
  std::vector<double> memory(1 + 16 + 48);
  std::ranges::copy(of_left, memory.begin() + 1);
  std::ranges::copy(of_right, memory.begin() + 9);
  const Eight& x = *reinterpret_cast<const Eight*>(&memory[1]);
  const Eight& y = *reinterpret_cast<const Eight*>(&memory[9]);
  Eight* out = reinterpret_cast<Eight*>(&memory[17]);
  out[0] = x * y;
  out[1] = 0.3 * x;
  out[2] = 2.0 / y;
  out[3] = where_greater(x, y, y);
  out[4] = x;
  out[4] += y;
  out[5] = x;
  out[5] -= y;
  EXPECT_EQ(x[6], of_left[6]);
  return {memory.begin() + 17, memory.end()};
}

TEST(Eight, ComputesNumberByNumber) {
  std::vector<double> expected;
  for (int k = 0; k < 8; ++k) expected.push_back(of_left[k] * of_right[k]);
  for (int k = 0; k < 8; ++k) expected.push_back(0.3 * of_left[k]);
  for (int k = 0; k < 8; ++k) expected.push_back(2.0 / of_right[k]);
  for (int k = 0; k < 8; ++k) expected.push_back(of_left[k] > of_right[k] ? of_right[k] : 0.0);
  for (int k = 0; k < 8; ++k) expected.push_back(of_left[k] + of_right[k]);
  for (int k = 0; k < 8; ++k) expected.push_back(of_left[k] - of_right[k]);
  EXPECT_EQ(results_of<16>(), expected);
  EXPECT_EQ(results_of<32>(), expected);
  EXPECT_EQ(results_of<64>(), expected);
}

TEST(WithWidestRegisters, CallsOnceWithOneOfTheWidths) {
  int calls = 0;
  int bytes = 0;
  llmt::with_widest_registers([&](auto eight) LLMT_INLINE_LAMBDA {
    ++calls;
    bytes = decltype(eight)::bytes;
  });
  EXPECT_EQ(calls, 1);
  EXPECT_TRUE(bytes == 16 || bytes == 32 || bytes == 64);
}

}  // namespace
