/// \file
/// Sums of weights and residuals in bins, as whole numbers: they are exact, so they do not depend on the order of rows,
/// and the sums of a node minus those of one child are those of the other.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "boosted/binned_rows.hpp"

namespace llmt {

/// A weight in the upper 26 bits and a residual times its weight in the lower 38, both signed.
using PackedSum = std::int64_t;
inline constexpr int residual_bits = 38;

/// Rows beyond this number have sums that do not fit.
inline constexpr std::int64_t most_boosted_rows = std::int64_t{1} << 24;

/// What one unit of a packed sum is.
struct PackedUnits {
  double weight = 1.0;
  double residual = 1.0;
  double per_weight = 1.0;    ///< 1 / weight
  double per_residual = 1.0;  ///< 1 / residual
  double most = 0.0;          ///< units of residual that a row may have; more are cut, so that no sum overflows
};

/// Units in which the sums over all rows stay within their bits.
PackedUnits units_of(std::span<const double> residuals, std::span<const double> weights, bool equal_weights);

/// `Whole`: of 32 bits while `most` is within them, which compilers convert several at a time.
template <class Whole = std::int64_t>
PackedSum packed(double residual, double weight, const PackedUnits& units) {
  const auto whole_weight = static_cast<Whole>(weight * units.per_weight + 0.5);
  const double units_of_residual = std::clamp(residual * weight * units.per_residual, -units.most, units.most);
  const auto whole_residual = static_cast<Whole>(units_of_residual + std::copysign(0.5, units_of_residual));
  return (static_cast<PackedSum>(whole_weight) << residual_bits) + static_cast<PackedSum>(whole_residual);
}

/// packed() of some rows.
void pack_rows(std::span<const double> residuals, std::span<const double> weights, const PackedUnits& units,
               std::span<PackedSum> terms);

inline std::int64_t weight_of(PackedSum sum) {
  return (sum + (std::int64_t{1} << (residual_bits - 1))) >> residual_bits;
}
inline std::int64_t residual_of(PackedSum sum) { return sum - (weight_of(sum) << residual_bits); }

/// The sums in the bins of a feature; the last one is that of missing values.
using Histogram = std::array<PackedSum, most_bins + 1>;

struct HistogramOf {
  const std::uint8_t* bins = nullptr;  ///< BinnedFeature::bins
  Histogram* sums = nullptr;
};

/// Histograms that are formed in one pass over the rows: the processor adds to one while it waits for another.
inline constexpr std::size_t features_at_once = 2;

/// Adds the rows `rows`, whose terms are `terms`, to the bins of at most `features_at_once` features.
void add_to(std::span<const HistogramOf> histograms, std::span<const int> rows, std::span<const PackedSum> terms);

}  // namespace llmt
