/// \file
/// Transition of a blend from the left to the right child of a split: docs/algorithms/validities.md, V.1.
#pragma once

#include <cmath>

#include "base/simd.hpp"

namespace llmt {

/// Validity g of the left child: 1 for u <= -1, 0 for u >= 1, with `smoothness` continuous derivatives in between. 1 is
/// V.1. 2 occurs only in model files of earlier versions, whose predictions, derivatives and attributions it preserves.
LLMT_INLINE double transition(double u, int smoothness) {
  const double held = u < -1.0 ? -1.0 : u > 1.0 ? 1.0 : u;
  const double v = 0.5 * (held + 1.0);
  const double share =
      smoothness == 1 ? 1.0 - v * v * (3.0 - 2.0 * v) : 1.0 - v * v * v * (10.0 - v * (15.0 - 6.0 * v));
  return share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;  // rounding
}

/// Derivative of transition() with respect to u.
inline double transition_derivative(double u, int smoothness) {
  if (!(std::abs(u) < 1.0)) return 0.0;
  const double v = 0.5 * (u + 1.0);
  const double bump = v * (1.0 - v);
  return smoothness == 1 ? -3.0 * bump : -15.0 * bump * bump;
}

}  // namespace llmt
