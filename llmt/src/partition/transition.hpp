/// \file
/// Transition of a blend from the left to the right child of a split: docs/algorithms/validities.md, V.1.
#pragma once

#include <cmath>

#include "base/simd.hpp"

namespace llmt {

/// Validity g of the left child (V.1): 1 for u <= -1, 0 for u >= 1, with one continuous derivative.
LLMT_INLINE double transition(double u) {
  const double held = u < -1.0 ? -1.0 : u > 1.0 ? 1.0 : u;
  const double v = 0.5 * (held + 1.0);
  const double share = 1.0 - v * v * (3.0 - 2.0 * v);
  return share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;  // rounding
}

/// Derivative of transition() with respect to u.
inline double transition_derivative(double u) {
  if (!(std::abs(u) < 1.0)) return 0.0;
  const double v = 0.5 * (u + 1.0);
  return -3.0 * (v * (1.0 - v));
}

}  // namespace llmt
