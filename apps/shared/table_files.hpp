/// \file
/// Several files of rows as one table: the rows of a file behind those of the file before.
#pragma once

#include <Eigen/Core>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "llmt/arrow.hpp"
#include "llmt/csv.hpp"

namespace llmt::apps {

/// How numbers are written in CSV files.
struct NumberFormat {
  DecimalMark mark = DecimalMark::point;
  bool thousands = false;
};

/// The rows of CSV and Arrow files, all of numbers, from the first to the last. Errors name the file, and the line and
/// column where there is one.
class RowsInOrder {
 public:
  /// Throws std::runtime_error if the first file cannot be read.
  RowsInOrder(std::vector<std::string> paths, NumberFormat format);

  /// The columns of the first file; the others must have the same, in the same order.
  const std::vector<std::string>& columns() const { return columns_; }

  /// At least one row; nothing at the end.
  std::optional<Eigen::MatrixXd> next();

 private:
  void open();
  std::optional<Eigen::MatrixXd> next_of_file();

  std::vector<std::string> paths_;
  NumberFormat format_;
  std::size_t at_ = 0;
  std::vector<std::string> columns_;
  std::ifstream text_;
  std::optional<CsvPieces> pieces_;
  std::optional<Csv> first_;  // read for its columns
  std::optional<ArrowTable> table_;
  Eigen::Index row_ = 0;
};

/// Files of which any rows are read, so that the table need not fit into memory. CSV files, which must
/// be of numbers, are written as Arrow files in the folder for temporary files first.
class TableFiles {
 public:
  /// Throws std::runtime_error naming the file: one that cannot be read, has other columns than the first one (in
  /// another order is fine), or holds a CSV cell that is no number.
  explicit TableFiles(const std::vector<std::string>& paths, NumberFormat format = {});

  /// For messages: the file, or "a.arrow and 2 more files".
  std::string name() const;

  const std::vector<std::string>& columns() const { return files_.front().table.columns(); }
  Eigen::Index rows() const { return rows_; }

  /// As ArrowTable::read(). `levels`: of each column the names of its categories, of which the places are read, NaN for
  /// words that are not among them; none for numbers. Errors name the file.
  Eigen::MatrixXd read(Eigen::Index first, Eigen::Index count, const std::vector<std::string>& columns,
                       const std::vector<std::vector<std::string>>& levels = {}) const;

  /// Throws std::runtime_error for the first of these columns that does not exist, or holds no numbers in some file.
  void require_numbers(const std::vector<std::string>& columns) const;

  /// Throws std::runtime_error naming file and column if a column with levels holds numbers, or one without holds none.
  void check_kinds(const std::vector<std::string>& columns, const std::vector<std::vector<std::string>>& levels) const;

  /// Whether a column holds text or dates in the first file.
  bool has_text(const std::string& column) const { return files_.front().table.has_text(column); }

  /// The different words of a column of text, sorted, without the empty one.
  struct DifferentWords {
    std::vector<std::string> words;
    bool are_all = true;  ///< else there are more than were asked for, and some of them are in `words`
  };
  DifferentWords different_words(const std::string& column, std::size_t most) const;

  /// The different words of each column, sorted, without the empty one, which is a missing value; none for numbers.
  /// Reads all rows of columns of text. Throws std::runtime_error naming file and column: one that has text in some
  /// files and numbers in others, words that are not UTF-8, or more than `most` different ones.
  std::vector<std::vector<std::string>> levels(const std::vector<std::string>& columns, std::size_t most) const;

  /// Throws std::runtime_error `FILE: row 17: column "c": reason`; `row` is that of the whole table, and rows count
  /// from 1 in their file.
  [[noreturn]] void refuse(Eigen::Index row, const std::string& column, const std::string& reason) const;

 private:
  struct File {
    std::string path;
    ArrowTable table;
    Eigen::Index first = 0;  // row
  };

  const File& file_of(Eigen::Index row) const;
  std::vector<File> files_;
  Eigen::Index rows_ = 0;
};

}  // namespace llmt::apps
