/// \file
/// Tables of numbers from CSV text, with errors that name file, line and column.
///
///     const llmt::Csv table = llmt::Csv::read("heat_pump.csv");
///     const Eigen::MatrixXd values = table.numbers_or_missing(std::vector<std::string>{"outdoor_C", "flow_C"});
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <iosfwd>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/decimal_mark.hpp"

namespace llmt {

/// Whether the text of a cell, without outer blanks, says that there is no value: it is empty, or NA, N/A, NaN, null or
/// ? (in any case).
bool says_missing(std::string_view text);

/// What the cells of a column are when they are read as numbers.
struct ColumnCells {
  /// "There is no such row."
  static constexpr Eigen::Index no_row = std::numeric_limits<Eigen::Index>::max();

  Eigen::Index missing = 0;             ///< cells that are empty or say NA, N/A, NaN, null or ? (in any case)
  Eigen::Index marked = 0;              ///< those of the missing that are not empty: NA and the like
  Eigen::Index other = 0;               ///< cells that are neither missing nor a finite number
  Eigen::Index infinite = 0;            ///< those of the others that are numbers, as inf or 1e400
  Eigen::Index other_mark = 0;          ///< those of the others that are numbers with the other decimal mark
  Eigen::Index thousands = 0;           ///< those of the others that can only be numbers with separators of thousands
  Eigen::Index first_missing = no_row;  ///< row
  Eigen::Index first_marked = no_row;   ///< row of the first missing cell that is not empty: NA and the like
  Eigen::Index first_other = no_row;    ///< row
};

/// Columns read as numbers, whatever their cells say.
struct CsvNumbers {
  Eigen::MatrixXd values;          ///< rows x columns; NaN where the cell is not a number
  std::vector<ColumnCells> cells;  ///< per column
};

/// A cell is no number only because it has the other decimal mark.
class DecimalMarkError : public std::runtime_error {
 public:
  DecimalMarkError(const std::string& message, DecimalMark found) : std::runtime_error(message), found_(found) {}

  DecimalMark found() const { return found_; }

 private:
  DecimalMark found_;
};

/// A cell is no number only because it may have separators of thousands: "2,148" where the decimal mark is a point.
class ThousandsError : public DecimalMarkError {
 public:
  ThousandsError(const std::string& message, DecimalMark found, bool is_certain)
      : DecimalMarkError(message, found), is_certain_(is_certain) {}

  /// Whether the cell is no number with the other decimal mark either: "2,148.5".
  bool is_certain() const { return is_certain_; }

 private:
  bool is_certain_;
};

/// A name or a cell is not UTF-8, as in files of programs that write an 8-bit encoding.
class EncodingError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Thrown for a text without a header row.
class EmptyText : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A CSV text with a header row, kept as text. A column is turned into numbers when it is requested, so a column of
/// words does no harm unless it is requested as numbers. A request for several columns passes over the text once.
///
/// Accepted: fields separated by commas (or by semicolons or tabs, if the header has no comma); fields in double
/// quotes, which may hold separators, line breaks and doubled quotes (RFC 4180); LF or CRLF; a UTF-8 byte-order mark;
/// blank lines, which are skipped. Every row must have as many fields as the header. Numbers have the decimal mark that
/// is named; with a decimal comma the fields are separated by semicolons or tabs if the header has any.
///
/// Numbers with separators of thousands are refused unless read_thousands() was called.
///
/// `max_threads` is 0 for all that the machine has; results and errors do not depend on it.
class Csv {
 public:
  /// Reads a file. Throws std::runtime_error, starting with `path` or `path:line`, if it cannot be read, takes more
  /// than half of the machine's memory, has a line of more than 16 MiB, is empty or not UTF-8 (EncodingError), has line
  /// ends that are not LF or CRLF, a quote in the header that nothing closes, an unnamed or repeated column, or a row
  /// with too few or too many fields.
  static Csv read(const std::string& path, DecimalMark mark = DecimalMark::point);

  /// As read(), from memory; `name` stands for the path in errors.
  static Csv parse(std::string text, std::string name, DecimalMark mark = DecimalMark::point);

  /// Numbers may have separators of thousands from now on, groups of three digits behind the other decimal mark:
  /// "1,234.5", with a decimal comma "1.234,5".
  void read_thousands() { thousands_ = true; }

  const std::string& name() const { return name_; }
  const std::vector<std::string>& columns() const { return columns_; }
  Eigen::Index rows() const { return std::ssize(row_begins_); }

  bool has(std::string_view column) const { return fields_.contains(column); }

  /// Position of a column. Throws std::runtime_error naming the file and the columns it has, if there is none of that
  /// name.
  std::size_t index_of(std::string_view column) const;

  /// The named columns as numbers, rows x columns, rows in file order. Throws std::runtime_error `path:line: column
  /// "c": ...` at the first cell, in file order, that is empty, not a number, not finite or out of range
  /// (DecimalMarkError if it has the other decimal mark, ThousandsError if it may have separators of thousands); and as
  /// index_of().
  Eigen::MatrixXd numbers(std::span<const std::string> columns, int max_threads = 0) const;

  /// One column as numbers; errors as above.
  Eigen::VectorXd numbers(const std::string& column, int max_threads = 0) const;

  /// As numbers(), but a cell that is empty or says NA, N/A, NaN, null or ? (in any case) is missing, NaN.
  Eigen::MatrixXd numbers_or_missing(std::span<const std::string> columns, int max_threads = 0) const;

  /// As numbers(), but cells that are not numbers become NaN and are counted, and the caller decides what they mean.
  /// Errors as index_of() only.
  CsvNumbers read_numbers(std::span<const std::string> columns, int max_threads = 0) const;

  /// Throws the error of numbers() for the first cell, in file order, among the cells in rows[i] of columns[i]. Does
  /// nothing if all rows are ColumnCells::no_row.
  void refuse_first(std::span<const std::string> columns, std::span<const Eigen::Index> rows) const;

  /// Throws std::runtime_error `path:line: column "c": reason`.
  [[noreturn]] void refuse(Eigen::Index row, std::string_view column, const std::string& reason) const;

  /// Calls visit(row, i, text) for the cell of columns[i] in every row, in file order. The text has neither quotes nor
  /// outer blanks, and lives as long as the call; whether NA is a word or no value is for the caller to say, see
  /// says_missing(). A column may be named once. Errors as index_of(); throws EncodingError `path:line: column "c":
  /// ...` at a cell that is not UTF-8.
  void visit_texts(std::span<const std::string> columns,
                   const std::function<void(Eigen::Index, std::size_t, std::string_view)>& visit) const;

  /// One column as text, as visit_texts() has it, but empty where says_missing(); errors too.
  std::vector<std::string> texts(const std::string& column) const;

  /// The text of a row as it stands in the file, without its line end.
  std::string_view row_text(Eigen::Index row) const;

  /// The header as it stands in the file, without byte-order mark and line end.
  std::string_view header_text() const;

  /// Line of the file, counted from 1, on which a row begins. Counts the lines before it.
  Eigen::Index line_of(Eigen::Index row) const;

  /// Lines of ascending rows, counted in one go.
  std::vector<Eigen::Index> lines_of(std::span<const Eigen::Index> rows) const;

  /// The text with the given rows alone; lines in errors are still those of the whole text.
  Csv with_rows(std::span<const Eigen::Index> rows) const;

  char separator() const { return separator_; }
  DecimalMark decimal_mark() const { return mark_; }

 private:
  Csv() = default;

  std::string name_;
  std::string text_;
  char separator_ = ',';
  DecimalMark mark_ = DecimalMark::point;
  bool thousands_ = false;
  std::size_t header_begin_ = 0;
  std::vector<std::string> columns_;
  std::map<std::string, std::size_t, std::less<>> fields_;  // position of a column
  std::vector<std::size_t> row_begins_;                     // offsets into text_
  Eigen::Index lines_left_out_ = 0;                         // between the header and the first row, see CsvPieces
  bool rows_precede_ = false;                               // other pieces' rows, see CsvPieces
  bool more_follows_ = false;

  friend class CsvPieces;
  void read_header();
  void refuse_header_of_other_programs(std::string_view header) const;
  void find_rows();
  std::string_view record_text(std::size_t begin) const;
  Eigen::Index line_at(std::size_t offset) const;
};

/// Reads a CSV text that need not fit into memory. Its rows come a piece at a time, each piece with the header; errors
/// name the line of the whole text.
class CsvPieces {
 public:
  /// `name` stands for the path in errors. A piece is about `bytes` long, longer if a row is.
  CsvPieces(std::istream& input, std::string name, std::size_t bytes = 1 << 20, DecimalMark mark = DecimalMark::point);

  /// The next rows, at least one; nothing at the end. Throws as Csv::read(), and if there is no header, if the stream
  /// cannot be read, or if a quoted field does not end within 16 MiB.
  std::optional<Csv> next();

 private:
  std::istream& input_;
  std::string name_;
  std::size_t bytes_;
  DecimalMark mark_;
  std::string pending_;     // what has been read and not yet handed out
  std::string header_;      // once it is known, with a line break
  Eigen::Index lines_ = 0;  // handed out, those of the header included
  bool has_given_rows_ = false;
};

/// `text` as one CSV field: in double quotes, inner quotes doubled, if it holds the separator, a quote or a line break.
std::string csv_field(std::string_view text, char separator = ',');

/// Fields for people, as messages list columns: a comma and a blank between them.
std::string csv_row(std::span<const std::string> fields);

}  // namespace llmt
