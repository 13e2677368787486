/// \file
/// Text for people: numbers, tables and lines of a given width.
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace llmt::report {

inline constexpr std::size_t no_width_limit = std::numeric_limits<std::size_t>::max();

/// Columns on a terminal: bytes of UTF-8 that begin a character.
std::size_t columns_of(std::string_view text);

/// The text with lines of at most `width` columns, broken at blanks. What follows a break is indented by `indent` more
/// than the line was. A word that is too long stands on a line of its own.
std::string wrapped(std::string_view text, std::size_t width, std::size_t indent = 0);

/// Rows of text under a header, columns aligned: words to the left, numbers to the right.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }

  /// If the table is wider than `width`, its widest column of words is broken into lines, then the headers of numbers;
  /// columns that still do not fit follow below, again with the first words.
  std::string text(std::size_t width = no_width_limit) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// A list of names for people: "a, b, c", or the first twenty "and 480 more".
std::string first_names(const std::vector<std::string>& names);

/// A number for people: `digits` significant digits, without an exponent where that is short.
std::string number(double value, int digits = 4);

}  // namespace llmt::report
