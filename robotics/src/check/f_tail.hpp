// The F distribution.
#pragma once

namespace llmt::robotics {

/// The probability that a value of the F distribution is larger than f; degrees of freedom above 0.
double f_tail(double f, double numerator, double denominator);

}  // namespace llmt::robotics
