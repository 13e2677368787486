// What chance alone gains.
#pragma once

#include "discovery/search/scoring.hpp"

namespace llmt::discovery {

/// The gain in score that the best single candidate exceeds at the false alarm rate when nothing is missing: the larger
/// of two nulls, each simulated through the projected signatures. Normal noise; and the residuals themselves with a
/// random sign for each sample, which keeps heavy tails and scatter that differs between samples.
///
/// The quantile so far out comes from the 90 % quantile of the draws and the tail of the likelihood ratio,
/// P(gain > x) ~ exp(-x / 2), instead of from the largest few draws.
double chance_gain(const Scoring& scoring, const SearchOptions& options);

}  // namespace llmt::discovery
