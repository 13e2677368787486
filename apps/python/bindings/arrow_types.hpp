/// \file
/// Types of Arrow columns, and which of them can be read.
#pragma once

#include <cstdint>
#include <string>

#include "python/bindings/arrow_abi.hpp"

namespace llmt::python {

/// How the cells of a column are stored.
struct CellType {
  enum class Kind { null, boolean, integer, unsigned_integer, floating, decimal, text, large_text, text_view, date };
  Kind kind = Kind::null;
  int bytes = 0;               ///< of a number
  int scale = 0;               ///< of a decimal: decimal digits behind the point
  std::int64_t per_day = 0;    ///< of a date or a moment: units in a day, of which the cells count
  bool is_dictionary = false;  ///< the above is that of the dictionary's values, and the cells are indices:
  int index_bytes = 0;
  bool index_is_signed = true;

  /// Dates are read as their text.
  bool is_text() const {
    return kind == Kind::text || kind == Kind::large_text || kind == Kind::text_view || kind == Kind::date;
  }
  /// Number of buffers of an array of such cells, without those of a dictionary; text_view: at least so many.
  std::int64_t buffers() const;
};

/// Throws nb::type_error that names `column` and the type in words if it cannot be read, std::runtime_error if the
/// schema breaks the specification.
CellType cell_type(const ArrowSchema& schema, const std::string& column);

}  // namespace llmt::python
