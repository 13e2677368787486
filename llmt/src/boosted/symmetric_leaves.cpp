// The leaves of a symmetric tree whose splits are there.
#include <algorithm>
#include <array>
#include <limits>
#include <tuple>
#include <type_traits>
#include <utility>

#include "base/parallel.hpp"
#include "base/simd.hpp"
#include "base/sum_over.hpp"
#include "boosted/symmetric_grower.hpp"

namespace llmt {
namespace {

// Their products for 64 leaves stay in the nearest memory of a processor.
constexpr Eigen::Index block_of_leaves = 16384;

// The values of the features that have slopes, then of any other one, whose slopes are 0: `size` in all.
template <int size>
std::array<const float*, size> columns_of(const BinnedRows& rows, const SlopeFeatures& features) {
  std::array<const float*, size> columns;
  for (int j = 0; j < size; ++j) {
    const int feature = std::cmp_less(j, features.size()) ? features[j] : 0;
    columns[j] = rows.features[feature].values.data();
  }
  return columns;
}

// Calls of(size) with a constant that is at least `size`. Few constants keep the program small.
template <class Of>
void with_room_for(std::size_t size, const Of& of) {
  if (size <= 3) return of(std::integral_constant<int, 3>());
  if (size <= 5) return of(std::integral_constant<int, 5>());
  of(std::integral_constant<int, most_boosted_slopes>());
}

// With v = (1, e, z) of a row, the sums of w v v' over the rows of a leaf: of its row i the first i / 4 + 1 quads of
// columns.
template <int size>
struct Products {
  static constexpr int numbers = size + 2;
  static constexpr int quads = (numbers + 3) / 4;

  static constexpr int start_of(int row) {
    int start = 0;
    for (int i = 0; i < row; ++i) start += 4 * (i / 4 + 1);
    return start;
  }
  static constexpr int all = start_of(numbers);
};

struct SumsOfLeaves {
  std::vector<double> products;  // Products::all of each leaf
  std::array<double, most_symmetric_leaves> low;
  std::array<double, most_symmetric_leaves> high;

  SumsOfLeaves& operator+=(const SumsOfLeaves& next) {
    for (std::size_t k = 0; k < products.size(); ++k) products[k] += next.products[k];
    for (std::size_t k = 0; k < low.size(); ++k) {
      low[k] = std::min(low[k], next.low[k]);
      high[k] = std::max(high[k], next.high[k]);
    }
    return *this;
  }
};

// of_leaf += of the rows 0 ... of the products those of v with weighted.
template <int size, int... row>
LLMT_INLINE void add_products(double* of_leaf, const std::array<double, size + 2>& v, const Quad* weighted,
                              std::integer_sequence<int, row...>) {
  using Of = Products<size>;
  const auto add = [&](auto i) LLMT_INLINE_LAMBDA {
    constexpr int start = Of::start_of(i());
    const Quad factor{v[i()], v[i()], v[i()], v[i()]};
    add_to_quad(of_leaf + start, factor * weighted[0]);
    if constexpr (i() >= 4) add_to_quad(of_leaf + start + 4, factor * weighted[1]);
    if constexpr (i() >= 8) add_to_quad(of_leaf + start + 8, factor * weighted[2]);
  };
  (add(std::integral_constant<int, row>()), ...);
}

template <int size, int... slope>
LLMT_INLINE void add_row(double* of_leaf, const LeafModel& model, const std::array<const float*, size>& columns,
                         Eigen::Index k, double residual, double w, std::integer_sequence<int, slope...>) {
  using Of = Products<size>;
  std::array<double, size + 2> v = {1.0, residual - model.constant, static_cast<double>(columns[slope][k])...};
  ((v[1] -= model.slopes[slope] * v[2 + slope]), ...);
  const auto at = [&](auto i) LLMT_INLINE_LAMBDA {
    if constexpr (i() < Of::numbers) return v[i()];
    return 0.0;
  };
  const auto quad_at = [&](auto q) LLMT_INLINE_LAMBDA {
    constexpr int first = 4 * q();
    return Quad{at(std::integral_constant<int, first>()), at(std::integral_constant<int, first + 1>()),
                at(std::integral_constant<int, first + 2>()), at(std::integral_constant<int, first + 3>())} *
           Quad{w, w, w, w};
  };
  const std::array<Quad, 3> weighted = {quad_at(std::integral_constant<int, 0>()),
                                        quad_at(std::integral_constant<int, 1>()),
                                        quad_at(std::integral_constant<int, 2>())};
  add_products<size>(of_leaf, v, weighted.data(), std::make_integer_sequence<int, Of::numbers>());
}

template <int size>
LLMT_INLINE void add_rows(SumsOfLeaves& sums, const std::uint8_t* leaves, const LeafModel* models,
                          const std::array<const float*, size>& columns, const double* residuals, const double* weights,
                          RowSpan rows) {
  double* const products = sums.products.data();
  for (Eigen::Index k = rows.begin; k < rows.end; ++k) {
    const int leaf = leaves[k - rows.begin];
    const double residual = residuals[k];
    sums.low[leaf] = std::min(sums.low[leaf], residual);
    sums.high[leaf] = std::max(sums.high[leaf], residual);
    add_row<size>(products + static_cast<std::ptrdiff_t>(leaf) * Products<size>::all, models[leaf], columns, k,
                  residual, weights[k], std::make_integer_sequence<int, size>());
  }
}

template <int size>
RegressorSums regressor_sums(const SumsOfLeaves& sums, int leaf, std::size_t slopes) {
  using Of = Products<size>;
  const double* const of_leaf = &sums.products[static_cast<std::size_t>(leaf) * Of::all];
  const auto product = [&](int i, int j) { return of_leaf[Of::start_of(i) + j]; };
  RegressorSums result{.n = product(0, 0), .s = product(1, 0), .low = sums.low[leaf], .high = sums.high[leaf]};
  for (int j = 0; j < static_cast<int>(slopes); ++j) {
    result.z[j] = product(2 + j, 0);
    result.ze[j] = product(2 + j, 1);
    for (int i = 0; i <= j; ++i) result.zz[j][i] = product(2 + j, 2 + i);
  }
  return result;
}

// A leaf without rows keeps its path's model within the range of the rows of the nearest node above.
std::pair<double, double> range_above(const SumsOfLeaves& sums, std::size_t leaf) {
  std::pair<double, double> range = {sums.low[leaf], sums.high[leaf]};
  for (std::size_t size = 2; range.first > range.second; size *= 2) {
    const std::size_t first = leaf / size * size;
    range.first = *std::min_element(sums.low.begin() + first, sums.low.begin() + first + size);
    range.second = *std::max_element(sums.high.begin() + first, sums.high.begin() + first + size);
  }
  return range;
}

template <int size>
LLMT_INLINE void subtract_rows(double* residuals, double rate, const std::uint8_t* leaves, const LeafModel* models,
                               const std::array<const float*, size>& columns, RowSpan rows) {
  for (Eigen::Index k = rows.begin; k < rows.end; ++k) {
    const LeafModel& model = models[leaves[k - rows.begin]];
    double value = model.constant;
    for (int j = 0; j < size; ++j) value += model.slopes[j] * static_cast<double>(columns[j][k]);
    residuals[k] -= rate * std::min(std::max(value, model.low), model.high);
  }
}

}  // namespace

void SymmetricGrower::fit_leaves(const Eigen::VectorXd& residuals) {
  with_room_for(features_.size(), [&](auto room) {
    constexpr int size = room();
    const std::array<const float*, size> columns = columns_of<size>(rows_, features_);
    SumsOfLeaves zero;
    zero.products.assign(models_.size() * Products<size>::all, 0.0);
    zero.low.fill(std::numeric_limits<double>::infinity());
    zero.high.fill(-std::numeric_limits<double>::infinity());
    const SumsOfLeaves sums =
        sum_over(RowBlocks{count_, block_of_leaves}, max_threads_, zero, [&](RowSpan block, SumsOfLeaves& of_block) {
          std::array<std::uint8_t, block_of_leaves> leaves;
          leaves_of_rows(block.begin, std::span(leaves).first(block.count()));
          with_widest_registers([&](auto) LLMT_INLINE_LAMBDA {
            add_rows<size>(of_block, leaves.data(), models_.data(), columns, residuals.data(), rows_.weights.data(),
                           block);
          });
        });
    means_.assign(models_.size(), {});
    for (std::size_t leaf = 0; leaf < models_.size(); ++leaf) {
      const RegressorSums of_leaf = regressor_sums<size>(sums, static_cast<int>(leaf), features_.size());
      LeafModel& model = models_[leaf];
      has_rows_[leaf] = of_leaf.n > 0.0;
      if (has_rows_[leaf]) {
        add_estimate(model, static_cast<int>(features_.size()), of_leaf, options_.ridges);
        means_[leaf] = means_of(of_leaf, features_, lacked_);
      } else {
        std::tie(model.low, model.high) = range_above(sums, leaf);
      }
    }
  });
}

void SymmetricGrower::subtract_last(const GrowingTree& tree, double rate, Eigen::VectorXd& residuals) const {
  std::vector<double> of_lacking;  // they may be on both sides of a split
  for (const int row : lacking_) of_lacking.push_back(residuals(row) - rate * value_at(tree, rows_, row));
  with_room_for(features_.size(), [&](auto room) {
    constexpr int size = room();
    const std::array<const float*, size> columns = columns_of<size>(rows_, features_);
    const RowBlocks blocks{residuals.size(), block_of_leaves};
    parallel_for(blocks.count(), max_threads_, [&](Eigen::Index block) {
      std::array<std::uint8_t, block_of_leaves> leaves;
      leaves_of_rows(blocks[block].begin, std::span(leaves).first(blocks[block].count()));
      with_widest_registers([&](auto) LLMT_INLINE_LAMBDA {
        subtract_rows<size>(residuals.data(), rate, leaves.data(), models_.data(), columns, blocks[block]);
      });
    });
  });
  for (std::size_t k = 0; k < lacking_.size(); ++k) residuals(lacking_[k]) = of_lacking[k];
}

}  // namespace llmt
