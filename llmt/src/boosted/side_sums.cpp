#include "boosted/side_sums.hpp"

#include <bit>

#include "base/simd.hpp"

namespace llmt {
namespace {

// What a row adds to all sums but that of weights.
LLMT_INLINE Quad terms_of(double w, double e, double z) { return Quad{w, w, w * z, w * z} * Quad{e, z, z, e}; }

SideSums sums_of(double weight, Quad sums) { return {weight, sums[0], sums[1], sums[2], sums[3]}; }

LLMT_FOR_EACH_INSTRUCTION_SET
SideSums sum_all(const double* weights, const double* residuals, const float* z, std::size_t count) {
  double weight = 0.0;
  Quad sums{};
  for (std::size_t k = 0; k < count; ++k) {
    weight += weights[k];
    sums += terms_of(weights[k], residuals[k], z[k]);
  }
  return sums_of(weight, sums);
}

// A row of the right side adds nothing to the sums of the left one: its bits are cleared, in place of a branch, which
// no processor could foresee.
LLMT_FOR_EACH_INSTRUCTION_SET
SumsOfBoth sum_both(const double* weights, const double* residuals, const float* z, const int* cells, int first,
                    std::size_t count) {
  double weight = 0.0;
  double weight_of_left = 0.0;
  Quad sums{};
  Quad sums_of_left{};
  for (std::size_t k = 0; k < count; ++k) {
    const Quad terms = terms_of(weights[k], residuals[k], z[k]);
    const std::int64_t of_left = (std::int64_t{cells[k]} - first) >> 63;  // all bits, or none
    weight += weights[k];
    sums += terms;
    weight_of_left += std::bit_cast<double>(std::bit_cast<std::int64_t>(weights[k]) & of_left);
    sums_of_left += std::bit_cast<Quad>(std::bit_cast<QuadMask>(terms) & of_left);
  }
  return {sums_of(weight, sums), sums_of(weight_of_left, sums_of_left)};
}

}  // namespace

SideSums sum_rows(const RowsInOrder& rows) {
  return sum_all(rows.weights.data(), rows.residuals.data(), rows.z.data(), rows.weights.size());
}

SumsOfBoth sum_sides(const RowsInOrder& rows, std::span<const int> cells, int first) {
  return sum_both(rows.weights.data(), rows.residuals.data(), rows.z.data(), cells.data(), first, cells.size());
}

}  // namespace llmt
