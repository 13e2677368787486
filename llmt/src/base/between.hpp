/// \file
/// The threshold between two neighbouring values.
#pragma once

#include <algorithm>
#include <cmath>

namespace llmt {

/// A threshold t with low <= t < high, for finite low < high: x <= t then holds for `low` and not for `high`.
///
/// It is the middle. Where the middle is rounded to `high`, as between adjacent doubles, or high - low overflows, it is
/// the double below `high`.
inline double between(double low, double high) { return std::min(low + 0.5 * (high - low), std::nextafter(high, low)); }

}  // namespace llmt
