#include "numerics/gram.hpp"

#include <algorithm>

#include "base/simd.hpp"

namespace llmt {
namespace {

// Number of doubles that stay in the first-level cache while several tiles pass over them.
constexpr Eigen::Index buffer_size = 2304;

// Up to this many columns the tiles read the rows where they are; with more, rows are first copied into a buffer. Rows
// that are longer than the buffer are also read where they are, so many at once.
constexpr Eigen::Index few_columns = 16;
constexpr Eigen::Index long_rows = 64;

// Rows are prefetched by this number of rows ahead, because the rows of a node are scattered over the features.
constexpr Eigen::Index ahead = 12;

// Rows of features that are scattered in memory.
struct Scattered {
  const double* features;
  Eigen::Index stride;
  const int* rows;
  Eigen::Index following;  // number of rows after the first that will be read
  const double* at(Eigen::Index k) const { return features + rows[k] * stride; }
  void prefetch(Eigen::Index k) const {
    const double* next = at(k + std::min(ahead, following - k));
    __builtin_prefetch(next);
    __builtin_prefetch(next + lanes);
  }
};

// Rows that lie one after the other.
struct Packed {
  const double* rows;
  Eigen::Index stride;
  const double* at(Eigen::Index k) const { return rows + k * stride; }
  void prefetch(Eigen::Index) const {}
};

// Rows of a tile, and its columns as vectors: what fits into 32 registers of 64 bytes, or 16 narrower ones.
template <class Lanes>
constexpr int rows_of_tile = Lanes::bytes / 8;
template <class Lanes>
constexpr int columns_of_tile = Lanes::bytes == 64 ? 2 : 1;

// Sums f_i f_j over `count` rows, for `Rows` columns i from `first_row` and `Columns` vectors of columns j from
// `first_column`, in registers.
template <class Lanes, int Rows, int Columns, class Source>
LLMT_INLINE void add_tile(const Source& source, Eigen::Index count, Eigen::Index first_row, Eigen::Index first_column,
                          double* gram) {
  Lanes sums[Rows][Columns] = {};
  for (Eigen::Index k = 0; k < count; ++k) {
    const double* row = source.at(k);
    if (first_row == 0) {
      source.prefetch(k);
    }
    const Lanes* right = reinterpret_cast<const Lanes*>(row + first_column);
    for (int i = 0; i < Rows; ++i) {
      for (int j = 0; j < Columns; ++j) {
        sums[i][j] += row[first_row + i] * right[j];
      }
    }
  }
  for (int i = 0; i < Rows; ++i) {
    Lanes* out = reinterpret_cast<Lanes*>(gram + GramShape::row_begin(first_row + i) + first_column);
    for (int j = 0; j < Columns; ++j) {
      out[j] += sums[i][j];
    }
  }
}

template <class Lanes, int Rows, class Source>
LLMT_INLINE void add_tile_row(const Source& source, Eigen::Index count, Eigen::Index first_row, double* gram) {
  constexpr int columns = columns_of_tile<Lanes>;
  Eigen::Index column = 0;
  for (; column + (columns - 1) * lanes <= first_row; column += columns * lanes) {
    add_tile<Lanes, Rows, columns>(source, count, first_row, column, gram);
  }
  if (column <= first_row) {
    add_tile<Lanes, Rows, 1>(source, count, first_row, column, gram);
  }
}

template <class Lanes, class Source>
LLMT_INLINE void add_tiles(const Source& source, Eigen::Index columns, Eigen::Index count, double* gram) {
  constexpr int rows = rows_of_tile<Lanes>;
  for (Eigen::Index row = 0; row < columns; row += rows) {
    if (rows <= 4 || columns - row > 4) {
      add_tile_row<Lanes, rows>(source, count, row, gram);
    } else {
      add_tile_row<Lanes, std::min(rows, 4)>(source, count, row, gram);
    }
  }
}

// For few columns, or very many: the tiles read the rows where they are.
template <class Lanes>
LLMT_INLINE void add_scattered(const double* features, Eigen::Index columns, const int* rows, Eigen::Index count,
                               Eigen::Index following, double* gram) {
  add_tiles<Lanes>(Scattered{features, columns, rows, following}, columns, count, gram);
}

// For many columns, and therefore many tiles: the rows are copied into a buffer first.
template <class Lanes>
LLMT_INLINE void add_packed(const double* features, Eigen::Index columns, const int* rows, Eigen::Index count,
                            Eigen::Index following, double* buffer, double* gram) {
  const Scattered source{features, columns, rows, following};
  const Eigen::Index stride = (columns + lanes - 1) / lanes * lanes;
  for (Eigen::Index k = 0; k < count; ++k) {
    const double* next = source.at(k + std::min(ahead, following - k));
    const double* from = source.at(k);
    for (Eigen::Index c = 0; c < stride; c += lanes) {
      __builtin_prefetch(next + c);
      *reinterpret_cast<Lanes*>(buffer + k * stride + c) = *reinterpret_cast<const Lanes*>(from + c);
    }
  }
  add_tiles<Lanes>(Packed{buffer, stride}, columns, count, gram);
}

template <class Lanes>
LLMT_INLINE void add_vectors(const double* from, double* to, Eigen::Index size) {
  for (Eigen::Index k = 0; k < size; k += lanes) {
    *reinterpret_cast<Lanes*>(to + k) += *reinterpret_cast<const Lanes*>(from + k);
  }
}

template <class Lanes>
LLMT_INLINE Lanes gather(const double* const* from, Eigen::Index at) {
  using Register = typename Lanes::Register;
  if constexpr (Lanes::bytes == 64) {
    return {Register{from[0][at], from[1][at], from[2][at], from[3][at], from[4][at], from[5][at], from[6][at],
                     from[7][at]}};
  } else if constexpr (Lanes::bytes == 32) {
    return {Register{from[0][at], from[1][at], from[2][at], from[3][at]},
            Register{from[4][at], from[5][at], from[6][at], from[7][at]}};
  } else {
    return {Register{from[0][at], from[1][at]}, Register{from[2][at], from[3][at]}, Register{from[4][at], from[5][at]},
            Register{from[6][at], from[7][at]}};
  }
}

// Eight factorisations at once, one in every lane. Row k of `factor` holds l_k0 d_0, l_k1 d_1, ..., in `unit` l_k0,
// l_k1, ...; `inverse` holds 1 / d or 0. A residual is one more row, whose pivot is its residual sum of squares.
template <class Lanes>
LLMT_INLINE void evaluate_eight(const double* const* grams, Eigen::Index coefficients, Eigen::Index columns,
                                const double* weights, double* scratch, double* rss, double* rank) {
  Lanes* row = reinterpret_cast<Lanes*>(scratch);
  Lanes* inverse = row + columns;
  Lanes* unit = inverse + columns;
  Lanes one;
  for (auto& part : one.parts) part = typename Lanes::Register{} + 1.0;
  Lanes total = {};
  Lanes ranks = {};
  for (Eigen::Index k = 0; k < columns; ++k) {
    const Eigen::Index begin = GramShape::row_begin(k);
    const Lanes diagonal = gather<Lanes>(grams, begin + k);
    Lanes pivot = diagonal;
    const Eigen::Index before = std::min(k, coefficients);
    Lanes* unit_k = unit + k * (k + 1) / 2;
    for (Eigen::Index j = 0; j < before; ++j) {
      const Lanes* unit_j = unit + j * (j + 1) / 2;
      Lanes sum = gather<Lanes>(grams, begin + j);
      for (Eigen::Index m = 0; m < j; ++m) {
        sum -= row[m] * unit_j[m];
      }
      row[j] = sum;
      const Lanes scaled = sum * inverse[j];
      pivot -= sum * scaled;
      if (k < coefficients) {
        unit_k[j] = scaled;
      }
    }
    if (k < coefficients) {
      const Lanes tolerated = pivot_tolerance * diagonal;
      inverse[k] = where_greater(pivot, tolerated, 1.0 / pivot);
      ranks += where_greater(pivot, tolerated, one);
    } else {
      total += weights[k - coefficients] * pivot;
    }
  }
  *reinterpret_cast<Lanes*>(rss) = where_greater(total, Lanes{}, total);
  *reinterpret_cast<Lanes*>(rank) = ranks;
}

}  // namespace

void add_rows(const Features& features, const int* rows, Eigen::Index count, double* gram) {
  const double* data = features.row(0);
  const Eigen::Index columns = features.columns();
  const Eigen::Index stride = (columns + lanes - 1) / lanes * lanes;
  const bool in_place = columns <= few_columns || stride > buffer_size;
  const Eigen::Index chunk = stride > buffer_size ? long_rows : buffer_size / stride;
  alignas(64) double buffer[buffer_size];
  for (Eigen::Index k = 0; k < count; k += chunk) {
    const Eigen::Index size = std::min(chunk, count - k);
    with_widest_registers([&](auto eight) LLMT_INLINE_LAMBDA {
      using Lanes = decltype(eight);
      if (in_place) {
        add_scattered<Lanes>(data, columns, rows + k, size, count - 1 - k, gram);
      } else {
        add_packed<Lanes>(data, columns, rows + k, size, count - 1 - k, buffer, gram);
      }
    });
  }
}

void add(const GramShape& shape, const double* other, double* gram) {
  with_widest_registers([&](auto eight)
                            LLMT_INLINE_LAMBDA { add_vectors<decltype(eight)>(other, gram, shape.size()); });
}

ResidualSums::ResidualSums(const GramShape& shape, const Eigen::VectorXd& weights)
    : shape_(shape), weights_(weights.begin(), weights.end()) {}

void ResidualSums::evaluate(const double* const* grams, Eigen::Index count, double* rss, int* rank) {
  const Eigen::Index columns = shape_.columns();
  scratch_.resize(2 * columns + columns * (columns + 1) / 2);
  for (Eigen::Index k = 0; k < count; k += lanes) {
    std::array<const double*, 8> eight;
    for (Eigen::Index l = 0; l < lanes; ++l) {
      eight[l] = grams[std::min(k + l, count - 1)];
    }
    std::array<double, 8> sums;
    std::array<double, 8> ranks;
    with_widest_registers([&](auto lanes_of) LLMT_INLINE_LAMBDA {
      evaluate_eight<decltype(lanes_of)>(eight.data(), shape_.coefficients(), shape_.columns(), weights_.data(),
                                         scratch_.front().values.data(), sums.data(), ranks.data());
    });
    for (Eigen::Index l = 0; l < std::min(lanes, count - k); ++l) {
      rss[k + l] = sums[l];
      rank[k + l] = static_cast<int>(ranks[l]);
    }
  }
}

void ResidualSums::evaluate(const std::vector<double>& grams, std::vector<double>& rss, std::vector<int>& rank) {
  std::vector<const double*> each(grams.size() / shape_.size());
  for (std::size_t i = 0; i < each.size(); ++i) each[i] = grams.data() + i * shape_.size();
  rss.resize(each.size());
  rank.resize(each.size());
  evaluate(each.data(), std::ssize(each), rss.data(), rank.data());
}

void SidesOfCuts::sum(const GramShape& shape, std::span<const double* const> parts, const double* before,
                      const double* behind) {
  const Eigen::Index size = shape.size();
  const Eigen::Index cuts = std::max<Eigen::Index>(0, std::ssize(parts) - 1);
  const auto add_part = [&](const double* so_far, Eigen::Index part, double* gram) {
    if (so_far != nullptr) {
      std::copy(so_far, so_far + size, gram);
    } else {
      std::fill(gram, gram + size, 0.0);
    }
    add(shape, parts[part], gram);
    return gram;
  };
  left.resize(cuts * size);
  for (Eigen::Index cut = 0; cut < cuts; ++cut) before = add_part(before, cut, left.data() + cut * size);
  right.resize(cuts * size);
  for (Eigen::Index cut = cuts; cut-- > 0;) behind = add_part(behind, cut + 1, right.data() + cut * size);
}

void SidesOfCuts::evaluate(ResidualSums& models) {
  models.evaluate(left, rss_left, rank_left);
  models.evaluate(right, rss_right, rank_right);
}

}  // namespace llmt
