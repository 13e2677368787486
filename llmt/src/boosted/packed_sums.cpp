#include "boosted/packed_sums.hpp"

#include <algorithm>
#include <cmath>

#include "base/simd.hpp"

namespace llmt {
namespace {

LLMT_FOR_EACH_INSTRUCTION_SET
void pack_within_32_bits(const double* residuals, const double* weights, std::size_t count, PackedUnits units,
                         PackedSum* __restrict terms) {
  for (std::size_t k = 0; k < count; ++k) terms[k] = packed<std::int32_t>(residuals[k], weights[k], units);
}

}  // namespace

void pack_rows(std::span<const double> residuals, std::span<const double> weights, const PackedUnits& units,
               std::span<PackedSum> terms) {
  constexpr double most_of_32_bits = 0x1p30;
  if (units.most < most_of_32_bits) {
    pack_within_32_bits(residuals.data(), weights.data(), terms.size(), units, terms.data());
    return;
  }
  for (std::size_t k = 0; k < terms.size(); ++k) terms[k] = packed(residuals[k], weights[k], units);
}

PackedUnits units_of(std::span<const double> residuals, std::span<const double> weights, bool equal_weights) {
  // Half of the bits that are there: rounding adds at most one half a row.
  constexpr double most_weight = 0x1p24;
  constexpr double most_residual = 0x1p36;
  double largest = 0.0;
  double weight = 0.0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    largest = std::max(largest, std::abs(residuals[i]) * weights[i]);
    weight += weights[i];
  }
  PackedUnits units;
  if (!equal_weights) units.weight = weight / most_weight;
  units.most = 2.0 * most_residual / static_cast<double>(residuals.size());
  if (largest > 0.0) units.residual = 2.0 * largest / units.most;
  units.per_weight = 1.0 / units.weight;
  units.per_residual = 1.0 / units.residual;
  return units;
}

void add_to(Histogram& histogram, const BinnedFeature& feature, std::span<const int> rows,
            std::span<const PackedSum> terms) {
  const std::uint8_t* const bins = feature.bins.data();
  for (std::size_t k = 0; k < rows.size(); ++k) histogram[bins[rows[k]]] += terms[k];
}

}  // namespace llmt
