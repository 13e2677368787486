/// \file
/// Cells of Arrow columns as numbers, and as positions in lists of words.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "python/bindings/arrow_abi.hpp"
#include "python/bindings/arrow_types.hpp"

namespace llmt::python {

/// Different words in order of appearance. They are views of the arrays that they come from, and of `made`.
struct Words {
  std::vector<std::string_view> in_order;
  std::unordered_map<std::string_view, double> positions;

  std::deque<std::string> made;                    ///< texts of dates
  std::unordered_map<std::int64_t, double> dates;  ///< positions of their texts

  double position_of(std::string_view word);

  /// Of date_text(count, per_day); all dates have the same `per_day`.
  double position_of_date(std::int64_t count, std::int64_t per_day);
};

/// Throws std::runtime_error if the array cannot hold `rows` cells of the type from cell `first`, counted before its
/// own offset, on, in all that the C interface lets a consumer see. It does not tell how long buffers are: a producer
/// is trusted that they are as long as its lengths, offsets and dictionaries say.
void require_cells(const ArrowArray& array, const CellType& type, std::int64_t first, std::int64_t rows,
                   const std::string& column);

/// Writes cells to `out`, which has room for `rows`: numbers, or positions in `words`; NaN: missing. `present`, with
/// the bit `present_from + i` for cell i, marks rows that are there; null: all are. The array has passed
/// require_cells(). Throws std::runtime_error for offsets, views and indices that lead out of their array.
void read_cells(const ArrowArray& array, const CellType& type, std::int64_t first, std::int64_t rows,
                const std::string& column, Words& words, double* out);

/// Bit `i` of a bitmap.
inline bool bit(const void* bitmap, std::int64_t i) {
  return ((static_cast<const std::uint8_t*>(bitmap)[i >> 3] >> (i & 7)) & 1) != 0;
}

}  // namespace llmt::python
