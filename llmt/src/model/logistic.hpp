/// \file
/// The logistic gate: how an oblique split hands over from one child to the other.
#pragma once

#include <bit>
#include <cstdint>

#include "base/simd.hpp"

namespace llmt {

/// Beyond this |u| the gate is 1 or, within less than the spacing of doubles below 1, 0.
inline constexpr double logistic_reach = 37.0;

/// 1 / (1 + exp(u)), exactly 1 left of -logistic_reach and 0 right of it, to a few units in the last place.
///
/// Its own exponential, of plain sums and products: the same bytes on every machine, which the C library does not
/// promise, and several at a time.
LLMT_INLINE double logistic(double u) {
  const double held = u < -logistic_reach ? -logistic_reach : u > logistic_reach ? logistic_reach : u;
  // exp(u) = 2^k exp(r), k the nearest whole number to u / ln 2: adding 1.5 * 2^52 rounds, and leaves k in the last
  // bits.
  constexpr double shift = 0x1.8p52;
  const double shifted = held * 1.4426950408889634 + shift;
  const double k = shifted - shift;
  const double r = (held - k * 6.93147180369123816490e-01) - k * 1.90821492927058770002e-10;  // ln 2 in two parts
  // The Taylor series; |r| <= ln(2) / 2, so the next term is 3e-18.
  double sum = 1.0 / 6227020800.0;
  sum = sum * r + 1.0 / 479001600.0;
  sum = sum * r + 1.0 / 39916800.0;
  sum = sum * r + 1.0 / 3628800.0;
  sum = sum * r + 1.0 / 362880.0;
  sum = sum * r + 1.0 / 40320.0;
  sum = sum * r + 1.0 / 5040.0;
  sum = sum * r + 1.0 / 720.0;
  sum = sum * r + 1.0 / 120.0;
  sum = sum * r + 1.0 / 24.0;
  sum = sum * r + 1.0 / 6.0;
  sum = sum * r + 0.5;
  sum = sum * r + 1.0;
  sum = sum * r + 1.0;
  const std::uint64_t power = (std::bit_cast<std::uint64_t>(shifted) + 1023U) << 52U;
  const double share = 1.0 / (1.0 + sum * std::bit_cast<double>(power));
  return u <= -logistic_reach ? 1.0 : u >= logistic_reach ? 0.0 : share;
}

/// Its derivative where its value is `share`.
inline double logistic_derivative(double share) { return -share * (1.0 - share); }

}  // namespace llmt
