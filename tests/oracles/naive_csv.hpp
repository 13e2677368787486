// A parser of CSV text that is slow and obvious.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <regex>
#include <string>
#include <vector>

namespace oracle::csv {

struct Record {
  std::string text;  // without the line break
  int line = 0;
};

inline std::string trimmed(std::string text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.back())) text.pop_back();
  while (!text.empty() && blank(text.front())) text.erase(0, 1);
  return text;
}

inline bool is_quoted(const std::string& text) { return text.size() >= 2 && text.front() == '"' && text.back() == '"'; }

inline std::string unquoted(const std::string& field) {
  const std::string text = trimmed(field);
  if (!is_quoted(text)) return text;
  const std::string inner = text.substr(1, text.size() - 2);
  std::string result;
  for (std::size_t i = 0; i < inner.size(); ++i) {
    result += inner[i];
    if (inner[i] == '"') ++i;
  }
  return result;
}

inline std::string bare(const std::string& field) {
  const std::string text = trimmed(field);
  return is_quoted(text) ? trimmed(text.substr(1, text.size() - 2)) : text;
}

inline std::vector<Record> records_of(const std::string& text) {
  std::vector<Record> records;
  Record record{"", 1};
  int line = 1;
  bool quoted = false;
  const auto finish = [&] {
    if (!trimmed(record.text).empty()) records.push_back(record);
  };
  for (const char c : text) {
    line += c == '\n' ? 1 : 0;
    quoted = quoted != (c == '"');
    if (c == '\n' && !quoted) {
      finish();
      record = {"", line};
    } else {
      record.text += c;
    }
  }
  finish();
  return records;
}

inline std::vector<std::string> fields_of(const Record& record, char separator) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (const char c : record.text) {
    quoted = quoted != (c == '"');
    if (c == separator && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

inline bool is_missing(const std::string& field) {
  static const std::regex mark("|na|n/a|nan|null|\\?", std::regex::icase);
  return std::regex_match(bare(field), mark);
}

// The number, or why there is none.
inline std::string read_number(const std::string& field, char mark, double& value) {
  static const std::regex number("[+-]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][+-]?[0-9]+)?");
  static const std::regex word("[+-]?(nan|inf|infinity)", std::regex::icase);
  const std::string text = bare(field);
  if (text.empty()) return "the cell is empty, a number is needed";
  // With exchanged marks the text is a number by the expression above if it is one with a decimal comma.
  std::string exchanged = text;
  for (char& c : exchanged) c = c == ',' ? '.' : c == '.' ? ',' : c;
  const std::string& with_point = mark == '.' ? text : exchanged;
  const std::string& with_comma = mark == '.' ? exchanged : text;
  const bool is_number = std::regex_match(with_point, number);
  value = is_number ? std::strtod(with_point.c_str(), nullptr) : std::nan("");
  if (is_number && std::isfinite(value)) return "";
  const std::string shown = text.size() > 60 ? text.substr(0, 60) + "..." : text;  // all is ASCII here
  const char* const separator = mark == '.' ? "comma" : "point";
  const std::regex thousands(mark == '.' ? "[+-]?[1-9][0-9]{0,2}(,[0-9]{3})+(\\.[0-9]*)?"
                                         : "[+-]?[1-9][0-9]{0,2}(\\.[0-9]{3})+(,[0-9]*)?");
  if (!is_number && std::regex_match(text, thousands)) {
    if (!std::regex_match(with_comma, number)) return fmt::format("'{}' has separators of thousands", shown);
    return fmt::format("'{}' has a {}, which may be a separator of thousands or a decimal {}", shown, separator,
                       separator);
  }
  if (!is_number && std::regex_match(with_comma, number)) {
    return fmt::format("'{}' has a decimal {}, and a decimal {} is expected", shown, mark == '.' ? "comma" : "point",
                       mark == '.' ? "point" : "comma");
  }
  return fmt::format("'{}' is not {}", shown, is_number || std::regex_match(text, word) ? "finite" : "a number");
}

// All is ASCII here but for a byte-order mark, of which a fault may leave a part.
// The first byte that is not UTF-8; 0: there is none.
inline int byte_not_utf8(const std::string& text) {
  for (const char c : std::regex_replace(text, std::regex("\xEF\xBB\xBF"), "")) {
    if (static_cast<unsigned char>(c) >= 128) return static_cast<unsigned char>(c);
  }
  return 0;
}

struct Table {
  std::vector<std::string> columns;
  std::vector<Record> records;
  std::vector<std::vector<std::string>> cells;  // as they stand in the text
  std::string error;                            // of finding the rows
};

inline Table naive(const std::string& text, char mark = '.') {
  Table table;
  table.records = records_of(text.starts_with("\xEF\xBB\xBF") ? text.substr(3) : text);
  if (table.records.empty()) {
    table.error = "t: the file is empty, a header row is needed";
    return table;
  }
  const Record header = table.records.front();
  if (table.records.size() == 1 && std::count(header.text.begin(), header.text.end(), '"') % 2 != 0) {
    table.error = fmt::format("t:{}: a quote is left open: the rest of the file would be the header", header.line);
    return table;
  }
  if (table.records.size() == 1 && std::regex_search(header.text, std::regex("\r[^\r\n \t,;]"))) {
    table.error = fmt::format("t:{}: lines end with CR alone, LF or CRLF is needed: tr '\\r' '\\n' converts such files",
                              header.line);
    return table;
  }
  table.records.erase(table.records.begin());
  char separator = ',';
  for (const char candidate : {'\t', ';', ','}) {
    if (header.text.find(candidate) != std::string::npos && (candidate != ',' || mark != ',')) separator = candidate;
  }
  // The carriage return of a line end is no part of the header.
  const std::string header_text =
      header.text.ends_with('\r') ? header.text.substr(0, header.text.size() - 1) : header.text;
  for (const std::string& field : fields_of({header_text, 0}, separator)) {
    const std::string name = unquoted(field);
    if (name.empty()) {
      table.error = fmt::format("t:{}: column {} of the header has no name", header.line, table.columns.size() + 1);
      return table;
    }
    if (const int byte = byte_not_utf8(name); byte > 0) {
      table.error = fmt::format("t:{}: byte 0x{:02x} of the name of column {} of the header is not UTF-8", header.line,
                                byte, table.columns.size() + 1);
      return table;
    }
    if (std::ranges::find(table.columns, name) != table.columns.end()) {
      table.error = fmt::format("t:{}: the header has column \"{}\" twice", header.line, name);
      return table;
    }
    table.columns.push_back(name);
  }
  for (const Record& record : table.records) {
    table.cells.push_back(fields_of(record, separator));
    const std::size_t fields = table.cells.back().size();
    if (fields != table.columns.size()) {
      const bool cut = &record == &table.records.back() && fields < table.columns.size();
      table.error = fmt::format("t:{}: the row has {} field{}, the header has {}{}", record.line, fields,
                                fields == 1 ? "" : "s", table.columns.size(), cut ? " (is the file cut off?)" : "");
      return table;
    }
  }
  return table;
}

// The named columns, or the first error in the order of the file.
std::string naive_numbers(const Table& table, const std::vector<std::size_t>& wanted, bool allow_missing,
                          Eigen::MatrixXd& values, char mark = '.') {
  values.resize(std::ssize(table.cells), std::ssize(wanted));
  for (std::size_t row = 0; row < table.cells.size(); ++row) {
    for (std::size_t field = 0; field < table.columns.size(); ++field) {
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        if (wanted[i] != field) continue;
        double value = std::nan("");
        const std::string& cell = table.cells[row][field];
        const bool is_left_out = allow_missing && is_missing(cell);
        const std::string problem = is_left_out ? "" : read_number(cell, mark, value);
        if (!problem.empty()) {
          return fmt::format("t:{}: column \"{}\": {}", table.records[row].line, table.columns[field], problem);
        }
        values(row, i) = value;
      }
    }
  }
  return "";
}

}  // namespace oracle::csv
