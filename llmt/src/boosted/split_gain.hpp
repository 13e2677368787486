/// \file
/// The gain of a split from the sums in the bins of its feature.
#pragma once

#include <array>

#include "boosted/binned_rows.hpp"
#include "boosted/packed_sums.hpp"
#include "boosted/side_sums.hpp"

namespace llmt {

/// Ridges of the trees, in rows: of constants, and of slopes of standardised features.
struct Ridges {
  double constant = 1.0;
  double slope = 1.0;
};

/// What the side explains, g in add_gains().
double side_gain(const SideSums& side, const Ridges& ridges, bool slope);

/// A gain for every threshold of a feature: entry t is that behind bin t.
using Gains = std::array<double, most_bins>;

/// Adds to `gains` what the thresholds of a feature gain in one node: with the residuals e and the feature's values z
/// on one side,
///   g(side) = S^2 / (N + ridge) + C_ze^2 / (C_zz + ridge)
///   S = sum e, C_zz = sum (z - mean)^2, C_ze = sum (z - mean) e
/// the fit of a constant and a slope, and the gain is g(left) + g(right) - S^2 / (N + ridge) of the node. All values of
/// a bin are taken for its centre. Without `slopes` the second term is left out. Missing values go to one side.
void add_gains(Gains& gains, const BinnedFeature& feature, const Histogram& histogram, const PackedUnits& units,
               const Ridges& ridges, bool slopes, bool missing_left);

}  // namespace llmt
