#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/simd.hpp"
#include "base/sum_over.hpp"
#include "growth/best_first/residual_search.hpp"

namespace llmt {
namespace {

// A pooled variance below this part of the mean square is rounding.
constexpr double no_scatter = 1e-14;

// Student's statistic of two classes' means with the pooled variance. `squares`: sums about the class means;
// `largest_squares`: what they and the difference are rounding against.
double student(double difference, double squares, double largest_squares, const std::array<double, 2>& counts) {
  const double freedom = counts[0] + counts[1] - 2.0;
  const double tiny = no_scatter * largest_squares;
  if (!(freedom > 0.0) || difference * difference * (counts[0] + counts[1]) <= tiny) return 0.0;
  const double error = std::sqrt(std::max(squares, 0.0) / freedom * (1.0 / counts[0] + 1.0 / counts[1]));
  return squares <= tiny ? std::copysign(std::numeric_limits<double>::infinity(), difference) : difference / error;
}

// Sums over the rows of each class, + first.
struct ClassSums {
  std::array<double, 2> count{};  // weights
  std::array<double, 2> sum{};    // of the values
  std::array<double, 2> squares{};

  ClassSums& operator+=(const ClassSums& other) {
    for (std::size_t c = 0; c < 2; ++c) {
      count[c] += other.count[c];
      sum[c] += other.sum[c];
      squares[c] += other.squares[c];
    }
    return *this;
  }
};

// Weighted sums over the rows of either class, positive and negative, of values about `origin[class]`, or with
// `Absolute` of their magnitudes. Four partial sums run over the rows i, i + 4, .... There are no branches, because the
// signs of successive rows are unrelated.
template <bool Absolute>
LLMT_INLINE ClassSums class_sums(const double* values, const double* residuals, const double* weights,
                                 Eigen::Index count, const std::array<double, 2>& origin) {
  Quad counts[2] = {};
  Quad sums[2] = {};
  Quad squares[2] = {};
  for (Eigen::Index i = 0; i < count; i += quad) {
    const Eigen::Index left = count - i;
    const Quad value = load_quad(values + i, left);
    const QuadMask negative = load_quad(residuals + i, left) < 0.0;
    Quad z = value - (negative ? Quad{} + origin[1] : Quad{} + origin[0]);
    const QuadMask known = z == z;
    z = known ? z : Quad{};
    if constexpr (Absolute) {
      z = z < 0.0 ? -z : z;
    }
    const Quad weight = known ? load_quad(weights + i, left) : Quad{};
    const Quad of_class[2] = {negative ? Quad{} : weight, negative ? weight : Quad{}};
    for (int c = 0; c < 2; ++c) {
      counts[c] += of_class[c];
      sums[c] += of_class[c] * z;
      squares[c] += of_class[c] * z * z;
    }
  }
  ClassSums result;
  for (std::size_t c = 0; c < 2; ++c) {
    result.count[c] = sum_of(counts[c]);
    result.sum[c] = sum_of(sums[c]);
    result.squares[c] = sum_of(squares[c]);
  }
  return result;
}

LLMT_FOR_EACH_INSTRUCTION_SET
ClassSums about_origin(const double* values, const double* residuals, const double* weights, Eigen::Index count,
                       double origin) {
  return class_sums<false>(values, residuals, weights, count, {origin, origin});
}

LLMT_FOR_EACH_INSTRUCTION_SET
ClassSums distances_from(const double* values, const double* residuals, const double* weights, Eigen::Index count,
                         const std::array<double, 2>& means) {
  return class_sums<true>(values, residuals, weights, count, means);
}

}  // namespace

double ResidualStatistics::deviate() const {
  const double t = std::max(std::abs(means), std::abs(variances));
  return freedom > 0.0
             ? (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0) * std::sqrt(freedom * std::log1p(t * t / freedom))
             : 0.0;
}

ResidualStatistics residual_statistics(std::span<const double> values, std::span<const double> residuals,
                                       std::span<const double> weights) {
  ResidualStatistics result;
  result.low = std::numeric_limits<double>::infinity();
  result.high = -result.low;
  for (const double value : values) {
    result.low = value < result.low ? value : result.low;
    result.high = value > result.high ? value : result.high;
  }
  if (!(result.low < result.high)) return result;
  // About the middle of the range, so that the rounding depends neither on the input's offset nor on the order of rows.
  const double origin = result.low + 0.5 * (result.high - result.low);
  const RowBlocks blocks{std::ssize(values)};
  const ClassSums first = sum_over(blocks, 1, ClassSums{}, [&](RowSpan block, ClassSums& sum) {
    const Eigen::Index at = block.begin;
    sum += about_origin(values.data() + at, residuals.data() + at, weights.data() + at, block.count(), origin);
  });
  const std::array<double, 2>& count = first.count;
  result.freedom = count[0] + count[1] - 2.0;
  if (!(count[0] > 0.0 && count[1] > 0.0)) return result;
  result.positive_mean = origin + first.sum[0] / count[0];
  result.negative_mean = origin + first.sum[1] / count[1];
  const std::array<double, 2> means = {result.positive_mean, result.negative_mean};
  const ClassSums second = sum_over(blocks, 1, ClassSums{}, [&](RowSpan block, ClassSums& sum) {
    const Eigen::Index at = block.begin;
    sum += distances_from(values.data() + at, residuals.data() + at, weights.data() + at, block.count(), means);
  });
  const double within = second.squares[0] + second.squares[1];
  const double of_distances =
      within - second.sum[0] * second.sum[0] / count[0] - second.sum[1] * second.sum[1] / count[1];
  result.means =
      student(result.positive_mean - result.negative_mean, within, first.squares[0] + first.squares[1], count);
  result.variances = student(second.sum[0] / count[0] - second.sum[1] / count[1], of_distances, within, count);
  return result;
}

}  // namespace llmt
