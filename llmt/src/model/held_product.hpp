/// \file
/// The value of a product of two inputs. For sources compiled like lanes.hpp.
#pragma once

#include "llmt/model.hpp"
#include "model/hold.hpp"

namespace llmt {

/// Deviation of an input from its mean, held to the training extent: beyond it a product goes no further.
LLMT_INLINE double factor_at(const InputColumn& input, double x) {
  const double low = input.low - input.centre;
  const double high = input.high - input.centre;
  const double deviation = x - input.centre;
  return deviation > high || deviation < low ? hold(deviation, low, high) : deviation;
}

inline double factor_derivative(const InputColumn& input, double x) {
  return hold_derivative(x - input.centre, input.low - input.centre, input.high - input.centre);
}

}  // namespace llmt
