#include "llmt/csv.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "llmt/files.hpp"

namespace llmt {
namespace {

constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  return first == std::string_view::npos ? std::string_view{}
                                         : text.substr(first, text.find_last_not_of(" \t\r") + 1 - first);
}

/// Length of the field at the start of `record`.
std::size_t field_length(std::string_view record, char separator) {
  if (record.find('"') == std::string_view::npos) {
    return std::min(record.find(separator), record.size());
  }
  bool quoted = false;
  for (std::size_t i = 0; i < record.size(); ++i) {
    if (record[i] == '"') {
      quoted = !quoted;
    } else if (record[i] == separator && !quoted) {
      return i;
    }
  }
  return record.size();
}

/// Calls visit(index, field) for every field of a record; fields keep their quotes.
template <class Visit>
void for_each_field(std::string_view record, char separator, Visit visit) {
  for (std::size_t index = 0;; ++index) {
    const std::size_t length = field_length(record, separator);
    visit(index, record.substr(0, length));
    if (length == record.size()) {
      return;
    }
    record.remove_prefix(length + 1);
  }
}

std::string unquoted(std::string_view field) {
  field = trimmed(field);
  if (field.size() < 2 || field.front() != '"' || field.back() != '"') {
    return std::string(field);
  }
  std::string result;
  for (std::size_t i = 1; i + 1 < field.size(); ++i) {
    result += field[i];
    i += field[i] == '"' ? 1 : 0;  // a doubled quote stands for one
  }
  return result;
}

/// The number in a cell, or an explanation of why there is none.
double parse_number(std::string_view field, std::string& problem) {
  field = trimmed(field);
  if (field.size() >= 2 && field.front() == '"' && field.back() == '"') {
    field = trimmed(field.substr(1, field.size() - 2));
  }
  if (field.empty()) {
    problem = "the cell is empty, a number is needed";
    return 0.0;
  }
  const std::string_view digits = field.front() == '+' ? field.substr(1) : field;
  double value = 0.0;
  const fast_float::from_chars_result result =
      fast_float::from_chars(digits.data(), digits.data() + digits.size(), value);
  // Out of range is no error here: too large reads as infinity, too small as zero, whatever the version of fast_float
  // calls it.
  if ((result.ec != std::errc() && result.ec != std::errc::result_out_of_range) ||
      result.ptr != digits.data() + digits.size()) {
    problem = fmt::format("'{}' is not a number", field);
  } else if (!std::isfinite(value)) {
    problem = fmt::format("'{}' is not finite", field);
  }
  return value;
}

/// Whether a cell says that there is no value.
bool is_missing(std::string_view field) {
  const std::string text = unquoted(trimmed(field));
  std::string lower(trimmed(text));
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower.empty() || lower == "na" || lower == "n/a" || lower == "nan" || lower == "null" || lower == "?";
}

}  // namespace

Csv Csv::read(const std::string& path) { return parse(read_file(path), path); }

Csv Csv::parse(std::string text, std::string name) {
  Csv csv;
  csv.name_ = std::move(name);
  csv.text_ = std::move(text);
  csv.header_begin_ = csv.text_.starts_with(byte_order_mark) ? byte_order_mark.size() : 0;

  const bool has_quotes = csv.text_.find('"') != std::string::npos;
  bool header_seen = false;
  for (std::size_t begin = csv.header_begin_; begin < csv.text_.size();) {
    const std::size_t end =
        has_quotes ? csv.record_end(begin) : std::min(csv.text_.find('\n', begin), csv.text_.size());
    if (!trimmed(std::string_view(csv.text_).substr(begin, end - begin)).empty()) {
      if (header_seen) {
        csv.row_begins_.push_back(begin);
      } else {
        header_seen = true;
        csv.header_begin_ = begin;
      }
    }
    begin = end + 1;
  }
  if (!header_seen) {
    throw std::runtime_error(fmt::format("{}: the file is empty, a header row is needed", csv.name_));
  }

  const std::string_view header = csv.header_text();
  for (const char candidate : {',', ';', '\t'}) {
    if (header.find(candidate) != std::string_view::npos) {
      csv.separator_ = candidate;
      break;
    }
  }
  for_each_field(header, csv.separator_, [&](std::size_t index, std::string_view field) {
    std::string column = unquoted(field);
    if (column.empty()) {
      throw std::runtime_error(fmt::format("{}:{}: column {} of the header has no name", csv.name_,
                                           csv.line_at(csv.header_begin_), index + 1));
    }
    if (csv.has(column)) {
      throw std::runtime_error(
          fmt::format("{}:{}: the header has column \"{}\" twice", csv.name_, csv.line_at(csv.header_begin_), column));
    }
    csv.columns_.push_back(std::move(column));
  });
  csv.check_field_counts();
  return csv;
}

void Csv::check_field_counts() const {
  const bool has_quotes = text_.find('"') != std::string::npos;
  for (std::ptrdiff_t row = 0; row < rows(); ++row) {
    const std::string_view record = row_text(row);
    std::size_t fields = 0;
    if (has_quotes) {
      for_each_field(record, separator_, [&](std::size_t, std::string_view) { ++fields; });
    } else {
      fields = 1 + static_cast<std::size_t>(std::count(record.begin(), record.end(), separator_));
    }
    if (fields != columns_.size()) {
      throw std::runtime_error(fmt::format(
          "{}:{}: the row has {} field{}, the header has {}{}", name_, line_of(row), fields, fields == 1 ? "" : "s",
          columns_.size(), row + 1 == rows() && fields < columns_.size() ? " (is the file cut off?)" : ""));
    }
  }
}

bool Csv::has(std::string_view column) const {
  return std::find(columns_.begin(), columns_.end(), column) != columns_.end();
}

std::size_t Csv::index_of(std::string_view column) const {
  const auto found = std::find(columns_.begin(), columns_.end(), column);
  if (found == columns_.end()) {
    throw std::runtime_error(
        fmt::format("{}: there is no column \"{}\"; the columns are {}", name_, column, fmt::join(columns_, ", ")));
  }
  return static_cast<std::size_t>(found - columns_.begin());
}

Eigen::MatrixXd Csv::numbers(std::span<const std::string> columns) const { return read_numbers(columns, false); }

Eigen::MatrixXd Csv::numbers_or_missing(std::span<const std::string> columns) const {
  return read_numbers(columns, true);
}

std::vector<std::string> Csv::texts(const std::string& column) const {
  const std::size_t wanted = index_of(column);
  std::vector<std::string> result;
  for (std::ptrdiff_t row = 0; row < rows(); ++row) {
    for_each_field(row_text(row), separator_, [&](std::size_t index, std::string_view field) {
      if (index == wanted) {
        result.push_back(is_missing(field) ? std::string() : std::string(trimmed(unquoted(trimmed(field)))));
      }
    });
  }
  return result;
}

Eigen::MatrixXd Csv::read_numbers(std::span<const std::string> columns, bool allow_missing) const {
  constexpr std::ptrdiff_t unused = -1;
  std::vector<std::ptrdiff_t> target(columns_.size(), unused);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    std::ptrdiff_t& first = target[index_of(columns[i])];
    first = first == unused ? static_cast<std::ptrdiff_t>(i) : first;
  }
  Eigen::MatrixXd values(rows(), std::ssize(columns));
  std::string problem;
  for (std::ptrdiff_t row = 0; row < rows(); ++row) {
    for_each_field(row_text(row), separator_, [&](std::size_t index, std::string_view field) {
      if (target[index] == unused) {
        return;
      }
      if (allow_missing && is_missing(field)) {
        values(row, target[index]) = std::numeric_limits<double>::quiet_NaN();
        return;
      }
      values(row, target[index]) = parse_number(field, problem);
      if (!problem.empty()) {
        throw std::runtime_error(
            fmt::format("{}:{}: column \"{}\": {}", name_, line_of(row), columns_[index], problem));
      }
    });
  }
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::ptrdiff_t column = static_cast<std::ptrdiff_t>(i);
    if (const std::ptrdiff_t first = target[index_of(columns[i])]; first != column) {
      values.col(column) = values.col(first);  // asked for more than once
    }
  }
  return values;
}

Eigen::VectorXd Csv::numbers(const std::string& column) const {
  return numbers(std::span<const std::string>(&column, 1)).col(0);
}

std::string_view Csv::row_text(std::ptrdiff_t row) const {
  const std::size_t begin = row_begins_[static_cast<std::size_t>(row)];
  std::string_view text = std::string_view(text_).substr(begin, record_end(begin) - begin);
  return text.ends_with('\r') ? text.substr(0, text.size() - 1) : text;
}

std::string_view Csv::header_text() const {
  std::string_view text = std::string_view(text_).substr(header_begin_, record_end(header_begin_) - header_begin_);
  return text.ends_with('\r') ? text.substr(0, text.size() - 1) : text;
}

std::ptrdiff_t Csv::line_of(std::ptrdiff_t row) const { return line_at(row_begins_[static_cast<std::size_t>(row)]); }

std::ptrdiff_t Csv::line_at(std::size_t offset) const {
  return 1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(offset), '\n');
}

/// Offset of the line break, outside quotes, that ends the record at `begin`.
std::size_t Csv::record_end(std::size_t begin) const {
  std::size_t end = std::min(text_.find('\n', begin), text_.size());
  // A line with an odd number of quotes leaves one open: the record goes on.
  std::ptrdiff_t quotes = std::count(text_.begin() + static_cast<std::ptrdiff_t>(begin),
                                     text_.begin() + static_cast<std::ptrdiff_t>(end), '"');
  while (quotes % 2 != 0 && end < text_.size()) {
    const std::size_t next = std::min(text_.find('\n', end + 1), text_.size());
    quotes += std::count(text_.begin() + static_cast<std::ptrdiff_t>(end),
                         text_.begin() + static_cast<std::ptrdiff_t>(next), '"');
    end = next;
  }
  return end;
}

std::string csv_field(std::string_view text, char separator) {
  if (text.find_first_of("\"\r\n") == std::string_view::npos && text.find(separator) == std::string_view::npos) {
    return std::string(text);
  }
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c;
    if (c == '"') {
      quoted += c;
    }
  }
  return quoted + '"';
}

}  // namespace llmt
