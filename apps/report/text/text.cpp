#include "report/text/text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace llmt::report {
namespace {

constexpr std::size_t between_columns = 2;

bool looks_like_number(const std::string& text) {
  return text.find_first_not_of("0123456789.+-e%") == std::string::npos;
}

// Appends a line, broken at blanks.
void append_wrapped(std::string& result, std::string_view line, std::size_t width, std::size_t indent) {
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  std::size_t column = begin;
  result.append(begin, ' ');
  for (std::size_t at = begin; at < line.size();) {
    const std::size_t word = std::min(line.find_first_not_of(' ', at), line.size());
    const std::size_t end = std::min(line.find(' ', word), line.size());
    const std::string_view blanks = line.substr(at, word - at);
    const std::string_view text = line.substr(word, end - word);
    if (column > begin && column + blanks.size() + columns_of(text) > width) {
      result += '\n';
      result.append(begin + indent, ' ');
      column = begin + indent;
    } else {
      result += blanks;
      column += blanks.size();
    }
    result += text;
    column += columns_of(text);
    at = end;
  }
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

struct Column {
  bool numeric = false;
  std::size_t width = 0;
  std::size_t least = 0;  // of numbers, with the words of the header below each other
};

std::size_t longest_word(const std::string& text) {
  std::size_t longest = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    longest = std::max(longest, columns_of(std::string_view(text).substr(begin, end - begin)));
    begin = end + 1;
  }
  return longest;
}

std::size_t total_width(const std::vector<Column>& shapes) {
  std::size_t total = (shapes.size() - 1) * between_columns;
  for (const Column& shape : shapes) total += shape.width;
  return total;
}

// Breaks the widest column of words into lines where the table is too wide, then the headers of numbers.
void narrow(std::vector<Column>& shapes, std::size_t width) {
  if (total_width(shapes) <= width) return;
  constexpr std::size_t narrowest = 20;
  Column* widest = nullptr;
  for (Column& shape : shapes) {
    if (!shape.numeric && (widest == nullptr || shape.width > widest->width)) widest = &shape;
  }
  if (widest != nullptr && widest->width > narrowest) {
    const std::size_t others = total_width(shapes) - widest->width;
    widest->width = std::min(widest->width, std::max(narrowest, width > others ? width - others : 0));
  }
  if (total_width(shapes) <= width) return;
  for (Column& shape : shapes) {
    if (shape.numeric) shape.width = shape.least;
  }
}

// The columns of each block: one, or where they do not fit beside each other several, each with the first columns of
// words, or the first column alone where these leave too little.
std::vector<std::vector<std::size_t>> blocks_of(const std::vector<Column>& shapes, std::size_t width) {
  std::vector<std::size_t> key = {0};
  std::size_t key_width = shapes[0].width;
  for (std::size_t c = 1; c < shapes.size() && !shapes[c].numeric; ++c) {
    const std::size_t with_it = key_width + between_columns + shapes[c].width;
    if (with_it > width - width / 3) break;
    key.push_back(c);
    key_width = with_it;
  }
  std::vector<std::vector<std::size_t>> blocks = {key};
  std::size_t used = key_width;
  for (std::size_t c = key.size(); c < shapes.size(); ++c) {
    const std::size_t wanted = between_columns + shapes[c].width;
    if (blocks.back().size() > key.size() && used + wanted > width) {
      blocks.push_back(key);
      used = key_width;
    }
    blocks.back().push_back(c);
    used += wanted;
  }
  return blocks;
}

// A row of a block, over as many lines as its highest cell needs.
std::string row_text(const std::vector<std::string>& row, const std::vector<Column>& shapes,
                     const std::vector<std::size_t>& block) {
  std::vector<std::vector<std::string>> cells;
  std::size_t height = 1;
  for (const std::size_t c : block) {
    cells.push_back(lines_of(wrapped(row[c], shapes[c].width)));
    height = std::max(height, cells.back().size());
  }
  std::string text;
  for (std::size_t k = 0; k < height; ++k) {
    std::string line;
    for (std::size_t b = 0; b < block.size(); ++b) {
      const Column& shape = shapes[block[b]];
      const std::string cell = k < cells[b].size() ? cells[b][k] : std::string();
      const std::string padding(shape.width - std::min(shape.width, columns_of(cell)), ' ');
      if (b > 0) line.append(between_columns, ' ');
      if (shape.numeric) line += padding;
      line += cell;
      if (!shape.numeric) line += padding;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace

std::size_t columns_of(std::string_view text) {
  return std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; });
}

std::string wrapped(std::string_view text, std::size_t width, std::size_t indent) {
  std::string result;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    if (columns_of(line) <= width) {
      result += line;
    } else {
      append_wrapped(result, line, width, indent);
    }
    if (end < text.size()) result += '\n';
    begin = end + 1;
  }
  return result;
}

std::string Table::text(std::size_t width) const {
  const std::size_t columns = rows_.front().size();
  std::vector<Column> shapes(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    Column& shape = shapes[c];
    shape.numeric = rows_.size() > 1;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      const std::string& cell = rows_[r][c];
      shape.width = std::max(shape.width, columns_of(cell));
      shape.least = std::max(shape.least, r == 0 ? longest_word(cell) : columns_of(cell));
      shape.numeric = shape.numeric && (r == 0 || looks_like_number(cell));
    }
  }
  narrow(shapes, width);
  std::string text;
  for (const std::vector<std::size_t>& block : blocks_of(shapes, width)) {
    if (!text.empty()) text += "\n";
    for (const std::vector<std::string>& row : rows_) text += row_text(row, shapes, block);
  }
  return text;
}

std::string first_names(const std::vector<std::string>& names) {
  constexpr std::size_t most = 20;
  const auto end = names.begin() + static_cast<std::ptrdiff_t>(std::min(most, names.size()));
  const std::string more = names.size() > most ? fmt::format(" and {} more", names.size() - most) : "";
  return fmt::format("{}{}", fmt::join(names.begin(), end, ", "), more);
}

std::string number(double value, int digits) {
  if (std::isnan(value)) return "-";
  const double magnitude = std::abs(value);
  if (magnitude == 0.0) return "0";
  if (magnitude < 1e-4 || magnitude >= 1e7 || !std::isfinite(value)) {
    return fmt::format("{:.{}g}", value, digits);
  }
  const int before_point = 1 + static_cast<int>(std::floor(std::log10(magnitude)));
  return fmt::format("{:.{}f}", value, std::max(0, digits - before_point));
}

}  // namespace llmt::report
