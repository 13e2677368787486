// Samples that say nothing of an answer.
#pragma once

namespace llmt::discovery {

/// A sample that deviates by more noise floors than this, whatever is compared, is an outlier.
inline constexpr double far_off = 5.0;
/// Where a larger share of the samples is so far off, the noise floor is no measure of what is left, and none is an
/// outlier.
inline constexpr double largest_share_of_outliers = 0.15;

}  // namespace llmt::discovery
