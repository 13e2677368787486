#include "numerics/dense.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/simd.hpp"

namespace llmt {
namespace {

// Sizes of the blocks of a product: rows of a tile, rows of C, and the depth.
constexpr Eigen::Index tile_rows = 4;
constexpr Eigen::Index rows_of_c = 64;
constexpr Eigen::Index depth_block = 256;

// Rows of the panels in which a matrix is factored, and of the narrow panels inside them.
constexpr Eigen::Index panel = 256;
constexpr Eigen::Index narrow_panel = 32;

// Copies `columns` columns of a row-wise matrix into strips of `Width` columns, one strip after the other. Each strip
// is stored row by row and padded with zeros, so that a tile reads contiguous memory.
template <Eigen::Index Width>
void pack(const double* from, Eigen::Index stride, Eigen::Index depth, Eigen::Index columns, std::vector<double>& to) {
  const Eigen::Index strips = (columns + Width - 1) / Width;
  to.resize(strips * Width * depth);
  for (Eigen::Index strip = 0; strip < strips; ++strip) {
    const Eigen::Index used = std::min(Width, columns - strip * Width);
    const double* in = from + strip * Width;
    double* out = to.data() + strip * Width * depth;
    for (Eigen::Index k = 0; k < depth; ++k, in += stride, out += Width) {
      // The trip count is a constant, so that the compiler unrolls the loop: a call for eight numbers would cost more.
      for (Eigen::Index l = 0; l < Width; ++l) {
        out[l] = l < used ? in[l] : 0.0;
      }
    }
  }
}

// Adds the products of strips of A with strips of B, in tiles of tile_rows x lanes.
template <class Lanes>
LLMT_INLINE void multiply_strips(Eigen::Index rows, Eigen::Index columns, Eigen::Index depth, double sign,
                                 const double* a, const double* b, double* c, Eigen::Index c_stride) {
  for (Eigen::Index j = 0; j < columns; j += lanes) {
    const double* strip_b = b + j * depth;
    for (Eigen::Index i = 0; i < rows; i += tile_rows) {
      const double* strip_a = a + i * depth;
      Lanes sum[tile_rows] = {};
      for (Eigen::Index k = 0; k < depth; ++k) {
        const Lanes right = *reinterpret_cast<const Lanes*>(strip_b + k * lanes);
        for (Eigen::Index r = 0; r < tile_rows; ++r) {
          sum[r] += strip_a[k * tile_rows + r] * right;
        }
      }
      const Eigen::Index used = std::min(tile_rows, rows - i);
      for (Eigen::Index r = 0; r < used; ++r) {
        double* out = c + (i + r) * c_stride + j;
        if (j + lanes <= columns) {
          *reinterpret_cast<Lanes*>(out) += sign * sum[r];
        } else {
          for (Eigen::Index l = 0; l < columns - j; ++l) {
            out[l] += sign * sum[r][l];
          }
        }
      }
    }
  }
}

LLMT_FOR_EACH_INSTRUCTION_SET
void subtract_scaled(double* a, const double* b, double factor, Eigen::Index size) {
  for (Eigen::Index k = 0; k < size; ++k) {
    a[k] -= factor * b[k];
  }
}

}  // namespace

void add_transposed_product(Eigen::Index rows, Eigen::Index columns, Eigen::Index depth, double sign, const double* a,
                            Eigen::Index a_stride, const double* b, Eigen::Index b_stride, double* c,
                            Eigen::Index c_stride) {
  std::vector<double> packed_a;
  std::vector<double> packed_b;
  for (Eigen::Index k = 0; k < depth; k += depth_block) {
    const Eigen::Index deep = std::min(depth_block, depth - k);
    pack<lanes>(b + k * b_stride, b_stride, deep, columns, packed_b);
    for (Eigen::Index i = 0; i < rows; i += rows_of_c) {
      const Eigen::Index high = std::min(rows_of_c, rows - i);
      pack<tile_rows>(a + k * a_stride + i, a_stride, deep, high, packed_a);
      with_widest_registers([=, a = packed_a.data(), b = packed_b.data()](auto eight) LLMT_INLINE_LAMBDA {
        multiply_strips<decltype(eight)>(high, columns, deep, sign, a, b, c + i * c_stride, c_stride);
      });
    }
  }
}

bool factor_cholesky(RowMajor& matrix) {
  const Eigen::Index size = matrix.rows();
  double* data = matrix.data();
  const auto at = [&](Eigen::Index row, Eigen::Index column) { return data + row * size + column; };
  // Subtracts the part of the finished rows begin ... end from the rows end ... last.
  const auto subtract = [&](Eigen::Index begin, Eigen::Index end, Eigen::Index last) {
    for (Eigen::Index i = end; i < last; i += panel) {
      add_transposed_product(std::min(panel, last - i), size - i, end - begin, -1.0, at(begin, i), size, at(begin, i),
                             size, at(i, i), size);
    }
  };
  // Panels of rows, and narrow panels inside them, so that the part that is not yet factored is read and written
  // seldom.
  for (Eigen::Index outer = 0; outer < size; outer += panel) {
    const Eigen::Index outer_end = std::min(size, outer + panel);
    for (Eigen::Index inner = outer; inner < outer_end; inner += narrow_panel) {
      const Eigen::Index inner_end = std::min(outer_end, inner + narrow_panel);
      for (Eigen::Index r = inner; r < inner_end; ++r) {
        for (Eigen::Index t = inner; t < r; ++t) {
          subtract_scaled(at(r, r), at(t, r), *at(t, r), size - r);
        }
        const double pivot = *at(r, r);
        if (!(pivot > 0.0) || !std::isfinite(pivot)) return false;
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
