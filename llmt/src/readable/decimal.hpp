/// \file
/// Numbers with few decimal digits.
#pragma once

namespace llmt {

/// The largest e with 10^e <= value; value > 0.
int exponent_below(double value);

/// The multiple of 10^exponent nearest to the value, as the double that prints with the digits of that multiple.
double rounded(double value, int exponent);

/// A number in [low, high) that has as few digits as possible; low < high. Of those that are multiples of the same
/// power of ten the one nearest to the middle.
double shortest_between(double low, double high);

}  // namespace llmt
