#include "boosted/packed_sums.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/simd.hpp"

namespace llmt {
namespace {

// The largest |residual| times weight; in several places, which the compiler takes together.
LLMT_FOR_EACH_INSTRUCTION_SET
double largest_of(const double* residuals, const double* weights, std::size_t count) {
  constexpr std::size_t places = 16;
  std::array<double, places> largest = {};
  const std::size_t whole = count - count % places;
  for (std::size_t i = 0; i < whole; i += places) {
    for (std::size_t k = 0; k < places; ++k) {
      const double value = std::abs(residuals[i + k]) * weights[i + k];
      largest[k] = largest[k] < value ? value : largest[k];
    }
  }
  for (std::size_t i = whole; i < count; ++i) largest[0] = std::max(largest[0], std::abs(residuals[i]) * weights[i]);
  return *std::ranges::max_element(largest);
}

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
  const double largest = largest_of(residuals.data(), weights.data(), residuals.size());
  PackedUnits units;
  if (!equal_weights) units.weight = std::accumulate(weights.begin(), weights.end(), 0.0) / most_weight;
  units.most = 2.0 * most_residual / static_cast<double>(residuals.size());
  if (largest > 0.0) units.residual = 2.0 * largest / units.most;
  units.per_weight = 1.0 / units.weight;
  units.per_residual = 1.0 / units.residual;
  return units;
}

void add_to(std::span<const HistogramOf> histograms, std::span<const int> rows, std::span<const PackedSum> terms) {
  const std::size_t count = rows.size();
  if (histograms.size() == features_at_once) {
    const auto [bins, sums] = histograms[0];
    const auto [other_bins, other_sums] = histograms[1];
    for (std::size_t k = 0; k < count; ++k) {
      (*sums)[bins[rows[k]]] += terms[k];
      (*other_sums)[other_bins[rows[k]]] += terms[k];
    }
    return;
  }
  const auto [bins, sums] = histograms[0];
  for (std::size_t k = 0; k < count; ++k) (*sums)[bins[rows[k]]] += terms[k];
}

}  // namespace llmt
