/// \file
/// Holding a value to a range with a continuous derivative: docs/algorithms/guards.md, B.1.
#pragma once

#include "base/simd.hpp"

namespace llmt {

/// Length r of the parabola beyond either end of a range, as a fraction of the range.
inline constexpr double rounding_of_hold = 0.1;

/// hold(x) of B.1 for the range low ... high. `Number`: double or Quad.
template <class Number>
LLMT_INLINE Number hold(Number x, Number low, Number high) {
  const Number round = rounding_of_hold * (high - low);
  const Number beyond = x > high ? x - high : low - x;
  const Number parabola = 0.5 * beyond * beyond / round;
  return x > high  ? (beyond >= round ? high + 0.5 * round : x - parabola)
         : x < low ? (beyond >= round ? low - 0.5 * round : x + parabola)
                   : x;
}

/// Derivative of hold() with respect to x.
inline double hold_derivative(double x, double low, double high) {
  if (!(x > high || x < low)) return 1.0;
  const double round = rounding_of_hold * (high - low);
  const double beyond = x > high ? x - high : low - x;
  return beyond >= round ? 0.0 : 1.0 - beyond / round;
}

}  // namespace llmt
