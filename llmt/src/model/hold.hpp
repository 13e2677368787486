/// \file
/// Equation 13 of docs/algorithms.md: holding a value to a range.
#pragma once

#include "base/simd.hpp"

namespace llmt {

/// Over this fraction of a range the hold at its ends sets in.
inline constexpr double rounding_of_hold = 0.1;

/// `x` held to low ... high, with a parabola of length `round` at the ends; of numbers or quads.
template <class Number>
LLMT_INLINE Number hold(Number x, Number low, Number high) {
  const Number round = rounding_of_hold * (high - low);
  const Number beyond = x > high ? x - high : low - x;
  const Number parabola = 0.5 * beyond * beyond / round;
  return x > high  ? (beyond >= round ? high + 0.5 * round : x - parabola)
         : x < low ? (beyond >= round ? low - 0.5 * round : x + parabola)
                   : x;
}

inline double hold_derivative(double x, double low, double high) {
  if (!(x > high || x < low)) return 1.0;
  const double round = rounding_of_hold * (high - low);
  const double beyond = x > high ? x - high : low - x;
  return beyond >= round ? 0.0 : 1.0 - beyond / round;
}

}  // namespace llmt
