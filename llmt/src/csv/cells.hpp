/// \file
/// Records and fields of CSV text: quotes, blanks, missing values and numbers.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>

#include "llmt/decimal_mark.hpp"
#include "llmt/limits.hpp"

namespace llmt::csv {

/// A record that is longer is refused, in files and in pieces: an input without a line break must end before memory.
inline constexpr std::size_t longest_record = most(Limit::table_line);

/// Where the header begins: behind blank lines and a byte-order mark, in any order. The size of the text if there is
/// nothing else.
std::size_t header_begin(std::string_view text);

/// "byte 0xf6": the first byte of a text that is not UTF-8 (RFC 3629); empty if all is.
std::string byte_not_utf8(std::string_view text);

/// End of the field that begins at `begin`: its separator or line break, outside quotes, or `end`.
inline const char* field_end(const char* begin, const char* end, char separator) {
  bool quoted = false;
  for (; begin != end; ++begin) {
    if (*begin == '"') {
      quoted = !quoted;
    } else if ((*begin == separator || *begin == '\n') && !quoted) {
      break;
    }
  }
  return begin;
}

/// A line, or several where quotes hold line breaks.
struct Record {
  const char* end = nullptr;  ///< its line break, or the end of the text
  std::size_t fields = 0;
};
Record record_at(const char* begin, const char* end, char separator);

/// Nothing but blanks, which are spaces, tabs and carriage returns.
bool is_blank(std::string_view text);

/// A field as text: outer blanks and quotes taken off, doubled quotes halved.
std::string unquoted(std::string_view field);

/// The text of a cell as unquoted() has it, also without outer blanks inside the quotes. The result refers to `field`,
/// or to `buffer` if doubled quotes were halved.
std::string_view cell_text(std::string_view field, std::string& buffer);

/// How a table writes numbers: the decimal mark, and whether they may have separators of thousands.
struct Numbers {
  DecimalMark mark = DecimalMark::point;
  bool thousands = false;
};

/// `missing`: empty; `marked`: NA and the like; `other_mark`: a number with the other decimal mark; `thousands`: a
/// number that can only have separators of thousands.
enum class Cell { number, missing, marked, infinite, other_mark, thousands, word };

/// What the cell at `cursor` holds; a number is written to `value`. Moves `cursor` to the end of the field.
Cell read_cell(const char*& cursor, const char* end, char separator, const Numbers& numbers, double& value);

/// Whether a cell is a number with the other decimal mark and none with `mark`.
bool has_other_mark(std::string_view field, DecimalMark mark);

/// Whether a cell may be a number with separators of thousands: digits in groups of three behind the other decimal
/// mark.
bool may_have_thousands(std::string_view field, DecimalMark mark);

/// Why a cell is not a number.
std::string problem_of(std::string_view field, DecimalMark mark);

}  // namespace llmt::csv
