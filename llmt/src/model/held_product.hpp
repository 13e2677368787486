/// \file
/// Factors of a product of two inputs: docs/algorithms/data.md, D.1.
#pragma once

#include "llmt/model.hpp"
#include "model/hold.hpp"

namespace llmt {

/// Deviation e of an input from its mean (D.1), held to the training extent so that a product is constant far outside.
LLMT_INLINE double factor_at(const InputColumn& input, double x) {
  const double low = input.low - input.centre;
  const double high = input.high - input.centre;
  const double deviation = x - input.centre;
  return deviation > high || deviation < low ? hold(deviation, low, high) : deviation;
}

/// Derivative of factor_at() with respect to x.
inline double factor_derivative(const InputColumn& input, double x) {
  return hold_derivative(x - input.centre, input.low - input.centre, input.high - input.centre);
}

}  // namespace llmt
