/// \file
/// How much of a row goes to the right at a soft split.
#pragma once

#include <algorithm>

#include "llmt/boosted_sum.hpp"

namespace llmt {

/// 1/2 + u (3 - u^2) / 4 with u = (z - threshold) / half_width, for |u| < 1: continuous with its derivative.
inline double share_of_right(double z, double threshold, double half_width) {
  const double u = (z - threshold) / half_width;
  return 0.5 + u * (3.0 - u * u) / 4.0;
}

/// The smallest part of a row that goes to one side of a soft split in the trees that boosting grows.
inline constexpr double smallest_share = BoostedTree().smallest_share;

/// Whether a row, of which `share` has come to a split, goes to both sides. If one of them would get next to nothing,
/// the side on which the row lies takes all.
inline bool goes_both_ways(double share, double right, double smallest = smallest_share) {
  return share * std::min(right, 1.0 - right) >= smallest;
}

}  // namespace llmt
