#include "boosted/split_gain.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/simd.hpp"

namespace llmt {
namespace {

// Sums over the bins up to each one that holds rows: no gain changes at others. The bin of missing values comes first
// if it goes to the left.
struct RunningSums {
  int count = 0;
  std::array<int, most_bins + 1> bin;
  std::array<std::uint8_t, most_bins> count_up_to;  // each bin of the feature
  std::array<double, most_bins + 1> weight;
  std::array<double, most_bins + 1> residual;
  std::array<double, most_bins + 1> z;
  std::array<double, most_bins + 1> zz;
  std::array<double, most_bins + 1> ze;
  SideSums all = {};
};

// 1 for each bin that holds rows, else 0.
LLMT_FOR_EACH_INSTRUCTION_SET
void flag_bins(const PackedSum* histogram, std::uint8_t* __restrict flags) {
  for (int b = 0; b < most_bins; ++b) flags[b] = histogram[b] != 0 ? 1 : 0;
}

// Lists the bins that hold rows. Flags are taken as the bytes of words: times `ones`, a byte has the sum of those up to
// it; times `bits`, the highest byte has one bit for each.
void find_bins(RunningSums& sums, const Histogram& histogram) {
  static_assert(std::endian::native == std::endian::little && most_bins % 64 == 0);
  constexpr std::uint64_t ones = 0x0101010101010101;
  constexpr std::uint64_t bits = 0x0102040810204080;
  std::array<std::uint8_t, most_bins> flags;
  flag_bins(histogram.data(), flags.data());
  auto count = static_cast<std::uint64_t>(sums.count);
  for (int first = 0; first < most_bins; first += 64) {
    std::uint64_t set = 0;
    for (int b = 0; b < 64; b += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, &flags[first + b], sizeof word);
      const std::uint64_t up_to = (word + count) * ones;  // the first byte has those before the word too
      std::memcpy(&sums.count_up_to[first + b], &up_to, sizeof up_to);
      count = up_to >> 56;
      set |= (word * bits >> 56) << b;
    }
    for (; set != 0; set &= set - 1) sums.bin[sums.count++] = first + std::countr_zero(set);
  }
}

void run(RunningSums& sums, const BinnedFeature& feature, const Histogram& histogram, const PackedUnits& units,
         bool missing_left) {
  const double missing_weight = static_cast<double>(weight_of(histogram[missing_bin])) * units.weight;
  const double missing_residual = static_cast<double>(residual_of(histogram[missing_bin])) * units.residual;
  SideSums all;
  if (missing_left && histogram[missing_bin] != 0) {
    all.weight = missing_weight;
    all.residual = missing_residual;
    sums.bin[0] = -1;
    sums.weight[0] = missing_weight;
    sums.residual[0] = missing_residual;
    sums.z[0] = sums.zz[0] = sums.ze[0] = 0.0;
    sums.count = 1;
  }
  const int first = sums.count;
  find_bins(sums, histogram);
  for (int k = first; k < sums.count; ++k) {
    const PackedSum sum = histogram[sums.bin[k]];
    const double weight = static_cast<double>(weight_of(sum)) * units.weight;
    const double residual = static_cast<double>(residual_of(sum)) * units.residual;
    const double centre = feature.centres[sums.bin[k]];
    sums.weight[k] = all.weight += weight;
    sums.residual[k] = all.residual += residual;
    sums.z[k] = all.z += weight * centre;
    sums.zz[k] = all.zz += weight * centre * centre;
    sums.ze[k] = all.ze += residual * centre;
  }
  if (!missing_left) {
    all.weight += missing_weight;
    all.residual += missing_residual;
  }
  sums.all = all;
}

// S^2 / (N + c) + C_ze^2 / (C_zz + s) as one fraction; both 0 of no rows.
struct Fraction {
  double above = 0.0;
  double below = 1.0;
};

LLMT_INLINE Fraction gain_of(double n, double s, double z, double zz, double ze, const Ridges& ridges, double slope) {
  constexpr double tiny = 1e-100;  // in place of the weight of no rows
  const double spread = n * zz - z * z;
  const double common = slope * (n * ze - z * s);
  const double below_slope = n * ((spread > 0.0 ? spread : 0.0) + ridges.slope * n) + tiny;
  const double below = n + ridges.constant;
  return {s * s * below_slope + common * common * below, below * below_slope};
}

// The gains where the left side ends with each bin that holds rows.
LLMT_FOR_EACH_INSTRUCTION_SET
void gains_at(double* __restrict gains, const RunningSums& sums, const Ridges& ridges, double slope) {
  const SideSums& all = sums.all;
  const double of_node = all.residual * all.residual / (all.weight + ridges.constant);
  for (int k = 0; k < sums.count; ++k) {
    const Fraction left = gain_of(sums.weight[k], sums.residual[k], sums.z[k], sums.zz[k], sums.ze[k], ridges, slope);
    const Fraction right = gain_of(all.weight - sums.weight[k], all.residual - sums.residual[k], all.z - sums.z[k],
                                   all.zz - sums.zz[k], all.ze - sums.ze[k], ridges, slope);
    gains[k] = (left.above * right.below + right.above * left.below) / (left.below * right.below) - of_node;
  }
}

}  // namespace

double side_gain(const SideSums& side, const Ridges& ridges, bool slope) {
  const Fraction gain = gain_of(side.weight, side.residual, side.z, side.zz, side.ze, ridges, slope ? 1.0 : 0.0);
  return gain.above / gain.below;
}

void add_gains(Gains& gains, const BinnedFeature& feature, const Histogram& histogram, const PackedUnits& units,
               const Ridges& ridges, bool slopes, bool missing_left) {
  RunningSums sums;
  run(sums, feature, histogram, units, missing_left);
  std::array<double, most_bins + 2> of_count;
  gains_at(of_count.data() + 1, sums, ridges, slopes ? 1.0 : 0.0);
  const SideSums& all = sums.all;
  const Fraction unsplit = gain_of(all.weight, all.residual, all.z, all.zz, all.ze, ridges, slopes ? 1.0 : 0.0);
  of_count[0] = unsplit.above / unsplit.below - all.residual * all.residual / (all.weight + ridges.constant);
  for (int t = 0; t + 1 < feature.num_bins(); ++t) gains[t] += of_count[sums.count_up_to[t]];
}

}  // namespace llmt
