#include "shared/text.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <numeric>

namespace llmt::apps {
namespace {

constexpr std::size_t least_width = 40;
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

}  // namespace

std::size_t output_width() {
  if (::isatty(STDOUT_FILENO) == 0) return no_width_limit;
  std::size_t width = 0;
  winsize size = {};
  if (const char* const columns = std::getenv("COLUMNS"); columns != nullptr) {
    const std::string_view text(columns);
    std::from_chars(text.data(), text.data() + text.size(), width);
  } else if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0) {
    width = size.ws_col;
  }
  return width == 0 ? no_width_limit : std::max(width, least_width);
}

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
  std::vector<std::size_t> widths(columns, 0);
  std::vector<bool> numeric(columns, rows_.size() > 1);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      widths[c] = std::max(widths[c], columns_of(rows_[r][c]));
      numeric[c] = numeric[c] && (r == 0 || looks_like_number(rows_[r][c]));
    }
  }
  const std::size_t total = std::accumulate(widths.begin(), widths.end(), (columns - 1) * between_columns);
  if (total > width) {
    std::size_t widest = columns;
    for (std::size_t c = 0; c < columns; ++c) {
      if (!numeric[c] && (widest == columns || widths[c] > widths[widest])) widest = c;
    }
    constexpr std::size_t narrowest = 20;
    if (widest < columns && widths[widest] > narrowest) {
      const std::size_t others = total - widths[widest];
      widths[widest] = std::max(narrowest, width > others ? width - others : 0);
    }
  }
  std::string text;
  for (const std::vector<std::string>& row : rows_) {
    std::vector<std::vector<std::string>> cells;
    std::size_t height = 1;
    for (std::size_t c = 0; c < columns; ++c) {
      cells.push_back(lines_of(numeric[c] ? row[c] : wrapped(row[c], widths[c])));
      height = std::max(height, cells.back().size());
    }
    for (std::size_t k = 0; k < height; ++k) {
      std::string line;
      for (std::size_t c = 0; c < columns; ++c) {
        const std::string cell = k < cells[c].size() ? cells[c][k] : std::string();
        const std::string padding(widths[c] - std::min(widths[c], columns_of(cell)), ' ');
        if (c > 0) line.append(between_columns, ' ');
        if (numeric[c]) line += padding;
        line += cell;
        if (!numeric[c]) line += padding;
      }
      line.erase(line.find_last_not_of(' ') + 1);
      text += line + "\n";
    }
  }
  return text;
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

}  // namespace llmt::apps
