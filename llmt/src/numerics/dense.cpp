#include "numerics/dense.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/simd.hpp"

namespace llmt {
namespace {

constexpr std::ptrdiff_t tile_rows = 4;
constexpr std::ptrdiff_t block = 64;  // rows of C at a time
constexpr std::ptrdiff_t depth_block = 256;
constexpr std::ptrdiff_t panel = 256;  // rows of a Cholesky factor
constexpr std::ptrdiff_t narrow_panel = 32;

/// `columns` columns of a row-wise matrix as strips of `Width` columns, one strip after the other, row by row, filled
/// up with zeros: what a tile reads lies in a row.
template <std::ptrdiff_t Width>
void pack(const double* from, std::ptrdiff_t stride, std::ptrdiff_t depth, std::ptrdiff_t columns,
          std::vector<double>& to) {
  const std::ptrdiff_t strips = (columns + Width - 1) / Width;
  to.resize(static_cast<std::size_t>(strips * Width * depth));
  for (std::ptrdiff_t strip = 0; strip < strips; ++strip) {
    const std::ptrdiff_t used = std::min(Width, columns - strip * Width);
    const double* in = from + strip * Width;
    double* out = to.data() + strip * Width * depth;
    for (std::ptrdiff_t k = 0; k < depth; ++k, in += stride, out += Width) {
      // Constant trip counts: a call for eight numbers would cost more than they do.
      for (std::ptrdiff_t l = 0; l < Width; ++l) {
        out[l] = l < used ? in[l] : 0.0;
      }
    }
  }
}

/// Products of strips of A with strips of B, a tile of tile_rows x lanes each.
LLMT_FOR_EACH_INSTRUCTION_SET
void multiply_strips(std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t depth, double sign, const double* a,
                     const double* b, double* c, std::ptrdiff_t c_stride) {
  for (std::ptrdiff_t j = 0; j < columns; j += lanes) {
    const double* strip_b = b + j * depth;
    for (std::ptrdiff_t i = 0; i < rows; i += tile_rows) {
      const double* strip_a = a + i * depth;
      Lanes sum[tile_rows] = {};
      for (std::ptrdiff_t k = 0; k < depth; ++k) {
        const Lanes right = *reinterpret_cast<const Lanes*>(strip_b + k * lanes);
        for (std::ptrdiff_t r = 0; r < tile_rows; ++r) {
          sum[r] += strip_a[k * tile_rows + r] * right;
        }
      }
      const std::ptrdiff_t used = std::min(tile_rows, rows - i);
      for (std::ptrdiff_t r = 0; r < used; ++r) {
        double* out = c + (i + r) * c_stride + j;
        if (j + lanes <= columns) {
          *reinterpret_cast<Lanes*>(out) += sign * sum[r];
        } else {
          for (std::ptrdiff_t l = 0; l < columns - j; ++l) {
            out[l] += sign * sum[r][l];
          }
        }
      }
    }
  }
}

LLMT_FOR_EACH_INSTRUCTION_SET
void subtract_scaled(double* a, const double* b, double factor, std::ptrdiff_t size) {
  for (std::ptrdiff_t k = 0; k < size; ++k) {
    a[k] -= factor * b[k];
  }
}

}  // namespace

void add_transposed_product(std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t depth, double sign,
                            const double* a, std::ptrdiff_t a_stride, const double* b, std::ptrdiff_t b_stride,
                            double* c, std::ptrdiff_t c_stride) {
  std::vector<double> packed_a;
  std::vector<double> packed_b;
  for (std::ptrdiff_t k = 0; k < depth; k += depth_block) {
    const std::ptrdiff_t deep = std::min(depth_block, depth - k);
    pack<lanes>(b + k * b_stride, b_stride, deep, columns, packed_b);
    for (std::ptrdiff_t i = 0; i < rows; i += block) {
      const std::ptrdiff_t high = std::min(block, rows - i);
      pack<tile_rows>(a + k * a_stride + i, a_stride, deep, high, packed_a);
      multiply_strips(high, columns, deep, sign, packed_a.data(), packed_b.data(), c + i * c_stride, c_stride);
    }
  }
}

bool factor_cholesky(RowMajor& matrix) {
  const std::ptrdiff_t size = matrix.rows();
  double* data = matrix.data();
  const auto at = [&](std::ptrdiff_t row, std::ptrdiff_t column) { return data + row * size + column; };
  // Subtracts the rows begin ... end, which are done, from the rows `end` ... `last`.
  const auto subtract = [&](std::ptrdiff_t begin, std::ptrdiff_t end, std::ptrdiff_t last) {
    for (std::ptrdiff_t i = end; i < last; i += panel) {
      add_transposed_product(std::min(panel, last - i), size - i, end - begin, -1.0, at(begin, i), size, at(begin, i),
                             size, at(i, i), size);
    }
  };
  // Panels of rows, and narrow panels inside them, so that what is left is read and written seldom.
  for (std::ptrdiff_t outer = 0; outer < size; outer += panel) {
    const std::ptrdiff_t outer_end = std::min(size, outer + panel);
    for (std::ptrdiff_t inner = outer; inner < outer_end; inner += narrow_panel) {
      const std::ptrdiff_t inner_end = std::min(outer_end, inner + narrow_panel);
      for (std::ptrdiff_t r = inner; r < inner_end; ++r) {
        for (std::ptrdiff_t t = inner; t < r; ++t) {
          subtract_scaled(at(r, r), at(t, r), *at(t, r), size - r);
        }
        const double pivot = *at(r, r);
        if (!(pivot > 0.0) || !std::isfinite(pivot)) {
          return false;
        }
        const double inverse = 1.0 / std::sqrt(pivot);
        std::for_each(at(r, r), at(r, size), [&](double& value) { value *= inverse; });
      }
      subtract(inner, inner_end, outer_end);
    }
    subtract(outer, outer_end, size);
  }
  return true;
}

void solve_cholesky(const RowMajor& factor, Eigen::MatrixXd& right) {
  factor.triangularView<Eigen::Upper>().transpose().solveInPlace(right);
  factor.triangularView<Eigen::Upper>().solveInPlace(right);
}

}  // namespace llmt
