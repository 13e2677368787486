#include "readable/decimal.hpp"

#include <algorithm>
#include <cmath>

namespace llmt {
namespace {

// Beyond these exponents 10^|e| or its inverse is no double of full precision.
constexpr int largest_exponent = 290;

// Digits beyond which two doubles that differ have different texts.
constexpr int most_digits = 17;

}  // namespace

int exponent_below(double value) {
  int exponent = std::clamp(static_cast<int>(std::floor(std::log10(value))), -largest_exponent, largest_exponent);
  // The logarithm is rounded.
  if (std::pow(10.0, exponent) > value) --exponent;
  if (std::pow(10.0, exponent + 1) <= value) ++exponent;
  return exponent;
}

double rounded(double value, int exponent) {
  // A negative power of ten is no double, but its inverse is. So the result is a quotient of two whole numbers, which
  // is rounded once.
  const double unit = std::pow(10.0, std::abs(exponent));
  const double multiple = exponent < 0 ? std::round(value * unit) : std::round(value / unit);
  const double result = exponent < 0 ? multiple / unit : multiple * unit;
  return std::isfinite(result) ? result + 0.0 : value;
}

double shortest_between(double low, double high) {
  const double middle = low + 0.5 * (high - low);
  const int first = exponent_below(std::max({std::abs(low), std::abs(high), 1e-290})) + 1;
  for (int exponent = first; exponent > first - most_digits - 1; --exponent) {
    const double candidate = rounded(middle, exponent);
    if (candidate >= low && candidate < high) return candidate;
  }
  return low;
}

}  // namespace llmt
