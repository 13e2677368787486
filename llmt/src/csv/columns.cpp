#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "base/matrix.hpp"
#include "base/parallel.hpp"
#include "csv/cells.hpp"
#include "llmt/csv.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index unused = -1;

// The columns that are asked for, and where they lie.
struct Request {
  std::vector<std::size_t> field;  // per column asked for
  // Per field, up to the last one in use: the first column asked for that it is, or `unused`.
  std::vector<Eigen::Index> column;
};

Request request_of(const Csv& csv, std::span<const std::string> columns) {
  Request request;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::size_t field = request.field.emplace_back(csv.index_of(columns[i]));
    request.column.resize(std::max(request.column.size(), field + 1), unused);
    if (request.column[field] == unused) {
      request.column[field] = i;
    }
  }
  return request;
}

// Calls visit(column, cursor) for those fields of the record at `cursor` that are asked for; it has to move the cursor
// to the end of the field.
template <class Visit>
void for_each_requested(const Request& request, const char* cursor, const char* end, char separator, Visit visit) {
  for (const Eigen::Index column : request.column) {
    if (column == unused) {
      cursor = csv::field_end(cursor, end, separator);
    } else {
      visit(column, cursor);
    }
    ++cursor;
  }
}

void count_cell(ColumnCells& cells, csv::Cell cell, Eigen::Index row) {
  const bool missing = cell == csv::Cell::missing || cell == csv::Cell::marked;
  Eigen::Index& first = missing ? cells.first_missing : cells.first_other;
  first = std::min(first, row);
  ++(missing ? cells.missing : cells.other);
  if (cell == csv::Cell::infinite) ++cells.infinite;
  if (cell == csv::Cell::other_mark) ++cells.other_mark;
  if (cell == csv::Cell::thousands) ++cells.thousands;
  if (cell == csv::Cell::marked) {
    ++cells.marked;
    cells.first_marked = std::min(cells.first_marked, row);
  }
}

void add(ColumnCells& sum, const ColumnCells& part) {
  sum.missing += part.missing;
  sum.marked += part.marked;
  sum.other += part.other;
  sum.infinite += part.infinite;
  sum.other_mark += part.other_mark;
  sum.thousands += part.thousands;
  sum.first_marked = std::min(sum.first_marked, part.first_marked);
  sum.first_missing = std::min(sum.first_missing, part.first_missing);
  sum.first_other = std::min(sum.first_other, part.first_other);
}

// Rows on their way to the columns: they are written here, which stays in the cache, and not with a stride across the
// whole table.
using Buffer = RowMajor;

Eigen::Index buffered_rows(Eigen::Index columns) {
  constexpr Eigen::Index numbers = 1 << 13;
  return std::max<Eigen::Index>(8, numbers / std::max<Eigen::Index>(columns, 1));
}

// Number of rows that one task reads. There are few tasks, because each of them counts the cells of every column, and
// there may be thousands of columns.
Eigen::Index rows_of_task(Eigen::Index rows) { return std::max<Eigen::Index>(4096, rows / 256 + 1); }

}  // namespace

CsvNumbers Csv::read_numbers(std::span<const std::string> columns, int max_threads) const {
  const Request request = request_of(*this, columns);
  const char* const end = text_.data() + text_.size();
  CsvNumbers result{Eigen::MatrixXd(rows(), std::ssize(columns)), std::vector<ColumnCells>(columns.size())};

  const auto read_row = [&](Eigen::Index row, double* values, std::vector<ColumnCells>& cells) {
    const char* const begin = text_.data() + row_begins_[row];
    for_each_requested(request, begin, end, separator_, [&](std::size_t column, const char*& cursor) {
      const csv::Cell cell = csv::read_cell(cursor, end, separator_, {mark_, thousands_}, values[column]);
      if (cell != csv::Cell::number) {
        values[column] = std::numeric_limits<double>::quiet_NaN();
        count_cell(cells[column], cell, row);
      }
    });
  };
  const auto read_rows = [&](Eigen::Index first, Eigen::Index last) {
    std::vector<ColumnCells> cells(columns.size());
    Buffer buffer;
    for (Eigen::Index begin = first; begin < last; begin += buffer.rows()) {
      buffer.resize(std::min(buffered_rows(std::ssize(columns)), last - begin), std::ssize(columns));
      for (Eigen::Index i = 0; i < buffer.rows(); ++i) {
        read_row(begin + i, buffer.data() + i * buffer.cols(), cells);
      }
      result.values.middleRows(begin, buffer.rows()) = buffer;
    }
    return cells;
  };

  const Eigen::Index step = rows_of_task(rows());
  std::vector<std::vector<ColumnCells>> parts((rows() + step - 1) / step);
  parallel_for(std::ssize(parts), max_threads,
               [&](Eigen::Index task) { parts[task] = read_rows(task * step, std::min((task + 1) * step, rows())); });
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::size_t first = request.column[request.field[i]];
    if (first != i) {  // asked for more than once
      result.values.col(i) = result.values.col(first);
    }
    for (const std::vector<ColumnCells>& part : parts) {
      add(result.cells[i], part[first]);
    }
  }
  return result;
}

void Csv::refuse_first(std::span<const std::string> columns, std::span<const Eigen::Index> rows) const {
  std::pair<Eigen::Index, std::size_t> first{ColumnCells::no_row, 0};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    first = std::min(first, {rows[i], index_of(columns[i])});
  }
  const Eigen::Index row = first.first;
  const std::size_t wanted = first.second;
  if (row == ColumnCells::no_row) return;
  const Request request = request_of(*this, std::span<const std::string>(&columns_[wanted], 1));
  const std::string_view record = row_text(row);
  const char* const end = record.data() + record.size();
  for_each_requested(request, record.data(), end, separator_, [&](std::size_t, const char*& cursor) {
    const std::string_view field(cursor, csv::field_end(cursor, end, separator_));
    const std::string problem = csv::problem_of(field, mark_);
    const std::string message = fmt::format("{}:{}: column \"{}\": {}", name_, line_of(row), columns_[wanted], problem);
    const DecimalMark other = mark_ == DecimalMark::point ? DecimalMark::comma : DecimalMark::point;
    const bool has_other = csv::has_other_mark(field, mark_);
    if (csv::may_have_thousands(field, mark_)) throw ThousandsError(message, other, !has_other);
    if (has_other) throw DecimalMarkError(message, other);
    refuse(row, columns_[wanted], problem);
  });
}

Eigen::MatrixXd Csv::numbers(std::span<const std::string> columns, int max_threads) const {
  CsvNumbers read = read_numbers(columns, max_threads);
  std::vector<Eigen::Index> bad;
  for (const ColumnCells& cells : read.cells) {
    bad.push_back(std::min(cells.first_missing, cells.first_other));
  }
  refuse_first(columns, bad);
  return std::move(read.values);
}

Eigen::VectorXd Csv::numbers(const std::string& column, int max_threads) const {
  return numbers(std::span<const std::string>(&column, 1), max_threads).col(0);
}

Eigen::MatrixXd Csv::numbers_or_missing(std::span<const std::string> columns, int max_threads) const {
  CsvNumbers read = read_numbers(columns, max_threads);
  std::vector<Eigen::Index> bad;
  for (const ColumnCells& cells : read.cells) {
    bad.push_back(cells.first_other);
  }
  refuse_first(columns, bad);
  return std::move(read.values);
}

void Csv::visit_texts(std::span<const std::string> columns,
                      const std::function<void(Eigen::Index, std::size_t, std::string_view)>& visit) const {
  const Request request = request_of(*this, columns);
  const char* const end = text_.data() + text_.size();
  std::string buffer;
  for (Eigen::Index row = 0; row < rows(); ++row) {
    const char* const begin = text_.data() + row_begins_[row];
    for_each_requested(request, begin, end, separator_, [&](std::size_t column, const char*& cursor) {
      const char* const field = std::exchange(cursor, csv::field_end(cursor, end, separator_));
      const std::string_view cell = csv::cell_text(std::string_view(field, cursor), buffer);
      if (const std::string byte = csv::byte_not_utf8(cell); !byte.empty()) {
        throw EncodingError(fmt::format("{}:{}: column \"{}\": {} of the cell is not UTF-8", name_, line_of(row),
                                        columns[column], byte));
      }
      visit(row, column, cell);
    });
  }
}

std::vector<std::string> Csv::texts(const std::string& column) const {
  std::vector<std::string> result;
  result.reserve(row_begins_.size());
  visit_texts(std::span<const std::string>(&column, 1), [&](Eigen::Index, std::size_t, std::string_view text) {
    result.emplace_back(says_missing(text) ? std::string_view() : text);
  });
  return result;
}

}  // namespace llmt
