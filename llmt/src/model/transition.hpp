/// \file
/// Equation 6 of docs/algorithms.md: how a split hands over from one child to the other.
#pragma once

#include <cmath>

#include "base/simd.hpp"

namespace llmt {

/// 1 left of -1, 0 right of 1, and `smoothness` continuous derivatives: 1, or 2 in models that an earlier version
/// wrote. Fits make no such models any more; predictions, derivatives and attributions of these files stay what they
/// were.
LLMT_INLINE double transition(double u, int smoothness) {
  const double held = u < -1.0 ? -1.0 : u > 1.0 ? 1.0 : u;
  const double v = 0.5 * (held + 1.0);
  const double share =
      smoothness == 1 ? 1.0 - v * v * (3.0 - 2.0 * v) : 1.0 - v * v * v * (10.0 - v * (15.0 - 6.0 * v));
  return share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;  // rounding
}

inline double transition_derivative(double u, int smoothness) {
  if (!(std::abs(u) < 1.0)) return 0.0;
  const double v = 0.5 * (u + 1.0);
  const double bump = v * (1.0 - v);
  return smoothness == 1 ? -3.0 * bump : -15.0 * bump * bump;
}

}  // namespace llmt
