/// \file
/// Tables of numbers and text in Arrow IPC files (Feather version 2, not compressed), which need not fit into memory.
///
///     const llmt::ArrowTable table = llmt::ArrowTable::open("rows.arrow");
///     const Eigen::MatrixXd first = table.read(0, 1000, std::vector<std::string>{"x", "y"});
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// Gives the next rows, as many columns as names; nothing at the end.
using NextRows = std::function<std::optional<Eigen::MatrixXd>()>;

/// An Arrow IPC file of flat columns, opened for reading. What is read are integers of 8 to 64 bits and floating-point
/// numbers of 32 and 64 bits, text, whole or by a dictionary, and dates as text, all with or without missing values;
/// columns of other flat types may be there.
/// Copies share the file. It may be used by several threads at a time.
///
/// Source: the Arrow columnar format, versions 1.0 and later (metadata version 5; 4 is read, too).
class ArrowTable {
 public:
  /// Reads what describes the table. The file may be of any origin: throws std::runtime_error, starting with `path`, if
  /// it cannot be read, is no Arrow file, is cut off, describes parts that lie outside of it, overlap or do not go
  /// together, is beyond the limits of docs/threat-model.md, is compressed, big-endian, or has nested columns. A
  /// process that has many tables open opens the file again when it is read; it must then still be there.
  static ArrowTable open(const std::string& path);

  /// Rows as write_arrow() takes them, in a file in the folder for temporary files ($TMPDIR, or /tmp) that has no name:
  /// it is gone with the last copy of the table, or with the process, however that ends. `name` is path() and begins
  /// the errors. Throws as write_arrow(), and std::runtime_error `name: ...` with the folder if the file cannot be made
  /// or written.
  static ArrowTable hold(const std::string& name, const std::vector<std::string>& columns, const NextRows& next);

  const std::string& path() const;
  const std::vector<std::string>& columns() const;
  Eigen::Index rows() const;

  /// Rows first ... first + count - 1 of these columns, rows x columns; NaN where a value is missing. Throws
  /// std::runtime_error `path: ...` for a column that does not exist or holds no numbers, and if the file cannot be
  /// read; std::invalid_argument for rows that do not exist.
  Eigen::MatrixXd read(Eigen::Index first, Eigen::Index count, std::span<const std::string> columns) const;

  /// Whether a column holds text, or dates, whose text is date_text(). Throws std::runtime_error as read() for one that
  /// does not exist.
  bool has_text(const std::string& column) const;

  /// The cells of a column of text or dates; empty where one is missing. Throws as read().
  std::vector<std::string> texts(Eigen::Index first, Eigen::Index count, const std::string& column) const;

  struct Parts;

 private:
  std::shared_ptr<const Parts> parts_;
};

/// The text of a date or a moment that is counted from the beginning of 1970 in the proleptic Gregorian calendar:
/// `2024-02-29`, and where it is not midnight `2024-02-29 12:00:00.5`. `per_day`: units of `count` in a day, 1 or a
/// multiple of 86400. A moment with a zone of time is counted, and written, in UTC. Beyond the years -32767 ... 32767
/// the number of the day stands in the place of the date.
std::string date_text(std::int64_t count, std::int64_t per_day);

/// Whether a file begins as an Arrow file does. False for what is no regular file or cannot be read.
bool is_arrow_file(const std::string& path);

/// Number of rows of a table of this number of columns that are in memory at a time, and in a batch of write_arrow():
/// 65536, or as many as have 2^24 cells if that is fewer, and at least 1.
Eigen::Index arrow_rows_at_once(std::size_t columns);

/// Writes a table of 64-bit floating-point numbers, NaN as missing, in batches of arrow_rows_at_once() rows, through a
/// temporary file as write_file(). Returns the number of rows. Throws std::invalid_argument if there is no name, a name
/// is repeated, or rows have another number of columns; what `next` throws; and as write_file().
Eigen::Index write_arrow(const std::string& path, const std::vector<std::string>& columns, const NextRows& next);

}  // namespace llmt
