#include "csv/cells.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "llmt/csv.hpp"

namespace llmt {

bool says_missing(std::string_view text) {
  constexpr std::array<std::string_view, 6> marks = {"", "na", "n/a", "nan", "null", "?"};
  const auto same = [](char c, char mark) { return c == mark || (c >= 'A' && c <= 'Z' && c - 'A' + 'a' == mark); };
  return std::ranges::any_of(marks, [&](std::string_view mark) {
    return std::equal(text.begin(), text.end(), mark.begin(), mark.end(), same);
  });
}

}  // namespace llmt

namespace llmt::csv {
namespace {

constexpr std::string_view blanks = " \t\r";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(blanks);
  return first == std::string_view::npos ? std::string_view{}
                                         : text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

std::string_view without_quotes(std::string_view field) {
  const bool is_quoted = field.size() >= 2 && field.front() == '"' && field.back() == '"';
  return is_quoted ? field.substr(1, field.size() - 2) : field;
}

// Without outer blanks, quotes, and blanks inside them.
std::string_view bare(std::string_view field) { return trimmed(without_quotes(trimmed(field))); }

// End of the number at `begin`, null if there is none. A leading plus is accepted, leading white space is not. A number
// out of range is no error: too large reads as infinity, too small as zero. All three are handled here because versions
// and options of fast_float differ in them.
const char* number_end(const char* begin, const char* end, DecimalMark mark, double& value) {
  const bool has_sign = begin != end && (*begin == '+' || *begin == '-');
  const char* const first = begin + (has_sign ? 1 : 0);
  if (first == end || *first <= ' ' || *first == '-') return nullptr;
  const fast_float::parse_options options(fast_float::chars_format::general, static_cast<char>(mark));
  const fast_float::from_chars_result result =
      fast_float::from_chars_advanced(*begin == '+' ? first : begin, end, value, options);
  return result.ec == std::errc() || result.ec == std::errc::result_out_of_range ? result.ptr : nullptr;
}

// Whether the whole bare field is a number.
bool is_number(std::string_view text, DecimalMark mark, double& value) {
  const char* const end = text.data() + text.size();
  return number_end(text.data(), end, mark, value) == end;
}

char separator_of_thousands(DecimalMark mark) { return mark == DecimalMark::point ? ',' : '.'; }

// "-1,234,567.8": one to three digits, then groups of three, perhaps a fraction.
bool has_thousands(std::string_view text, DecimalMark mark) {
  const auto digits = [&](std::size_t at) {
    const std::size_t end = text.find_first_not_of("0123456789", at);
    return std::min(end, text.size()) - std::min(at, text.size());
  };
  std::size_t at = text.starts_with('-') || text.starts_with('+') ? 1 : 0;
  const std::size_t first = digits(at);
  if (first < 1 || first > 3 || text[at] == '0') return false;
  int groups = 0;
  for (at += first; at < text.size() && text[at] == separator_of_thousands(mark); at += 4, ++groups) {
    if (digits(at + 1) != 3) return false;
  }
  if (at < text.size() && text[at] == static_cast<char>(mark)) at += 1 + digits(at + 1);
  return groups > 0 && at == text.size();
}

// The same with the separators left out.
bool is_number_with_thousands(std::string_view text, DecimalMark mark, double& value) {
  if (!has_thousands(text, mark)) return false;
  std::string plain(text);
  std::erase(plain, separator_of_thousands(mark));
  return is_number(plain, mark, value);
}

bool is_number_with_other_mark(std::string_view text, DecimalMark mark) {
  double value = 0.0;
  return is_number(text, mark == DecimalMark::point ? DecimalMark::comma : DecimalMark::point, value);
}

// One past the blanks at `begin`. Where tabs separate they are not blank.
const char* after_blanks(const char* begin, const char* end, char separator) {
  while (begin != end && (*begin == ' ' || *begin == '\r' || *begin == '\t') && *begin != separator) {
    ++begin;
  }
  return begin;
}

// Bytes at the beginning of a text that are UTF-8.
std::size_t utf8_bytes(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto lead = static_cast<unsigned char>(text[i]);
    if (lead < 0x80) continue;
    const std::size_t more = lead >= 0xF0 ? 3 : lead >= 0xE0 ? 2 : 1;
    if (lead < 0xC2 || lead > 0xF4 || text.size() - i <= more) return i;
    const auto next = static_cast<unsigned char>(text[i + 1]);
    // Neither longer than needed, nor half of a pair of UTF-16, nor beyond U+10FFFF.
    if ((lead == 0xE0 && next < 0xA0) || (lead == 0xED && next > 0x9F) || (lead == 0xF0 && next < 0x90) ||
        (lead == 0xF4 && next > 0x8F)) {
      return i;
    }
    for (std::size_t k = 1; k <= more; ++k) {
      if ((static_cast<unsigned char>(text[i + k]) & 0xC0U) != 0x80U) return i;
    }
    i += more;
  }
  return text.size();
}

// A text that fits into a message: cut off after 60 bytes, and spelled out what is a byte of 0, which would end the
// message, or not UTF-8.
std::string shortened(std::string_view text) {
  constexpr std::size_t most = 60;
  std::size_t end = std::min(text.size(), most);
  while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) {
    --end;  // not within a character of UTF-8
  }
  std::string result;
  for (std::string_view rest = text.substr(0, end); !rest.empty();) {
    const std::size_t valid = utf8_bytes(rest);
    for (const char c : rest.substr(0, valid)) result += c == '\0' ? "\\0" : std::string(1, c);
    if (valid == rest.size()) break;
    result += fmt::format("\\x{:02x}", static_cast<unsigned char>(rest[valid]));
    rest.remove_prefix(valid + 1);
  }
  return end < text.size() ? result + "..." : result;
}

std::size_t count(const char* begin, const char* end, char wanted) {
  std::size_t result = 0;
  while (begin != end) {
    // At a time no more bytes than one byte can count: a vector register then has sixteen counters instead of two.
    const char* const stop = begin + std::min<Eigen::Index>(end - begin, std::numeric_limits<unsigned char>::max());
    unsigned char found = 0;
    for (; begin != stop; ++begin) {
      found = static_cast<unsigned char>(found + (*begin == wanted ? 1 : 0));
    }
    result += found;
  }
  return result;
}

// First `wanted`, or `end`.
const char* find(const char* begin, const char* end, char wanted) {
  const void* const found = std::memchr(begin, wanted, end - begin);
  return found == nullptr ? end : static_cast<const char*>(found);
}

}  // namespace

Record record_at(const char* begin, const char* end, char separator) {
  const char* record_end = find(begin, end, '\n');
  std::size_t quotes = count(begin, record_end, '"');
  if (quotes == 0) return {record_end, 1 + count(begin, record_end, separator)};
  // A line with an odd number of quotes leaves one open: the record goes on.
  while (quotes % 2 != 0 && record_end != end) {
    const char* const line = record_end;
    record_end = find(line + 1, end, '\n');
    quotes += count(line, record_end, '"');
  }
  // Without branches, which the processor would often predict wrongly.
  std::size_t fields = 1;
  bool quoted = false;
  for (const char* c = begin; c != record_end; ++c) {
    quoted = quoted != (*c == '"');
    fields += (*c == separator) > quoted ? 1 : 0;
  }
  return {record_end, fields};
}

std::size_t header_begin(std::string_view text) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  std::size_t begin = 0;
  while (begin < text.size()) {
    if (text.substr(begin).starts_with(byte_order_mark)) {
      begin += byte_order_mark.size();
      continue;
    }
    const std::size_t line_end = std::min(text.find('\n', begin), text.size());
    if (!is_blank(text.substr(begin, line_end - begin))) return begin;
    begin = std::min(line_end + 1, text.size());
  }
  return begin;
}

std::string byte_not_utf8(std::string_view text) {
  const std::size_t valid = utf8_bytes(text);
  return valid == text.size() ? "" : fmt::format("byte 0x{:02x}", static_cast<unsigned char>(text[valid]));
}

bool is_blank(std::string_view text) { return text.find_first_not_of(blanks) == std::string_view::npos; }

std::string unquoted(std::string_view field) {
  field = trimmed(field);
  const std::string_view inner = without_quotes(field);
  std::string result;
  for (std::size_t i = 0; i < inner.size(); ++i) {
    result += inner[i];
    i += inner[i] == '"' && inner.size() < field.size() ? 1 : 0;  // a doubled quote stands for one
  }
  return result;
}

std::string_view cell_text(std::string_view field, std::string& buffer) {
  const std::string_view text = bare(field);
  if (text.find('"') == std::string_view::npos) return text;
  buffer = unquoted(field);
  return trimmed(buffer);
}

Cell read_cell(const char*& cursor, const char* end, char separator, const Numbers& numbers, double& value) {
  const DecimalMark mark = numbers.mark;
  // Most cells hold a number and nothing else. The field then ends where the number ends, and no search for the
  // separator is needed.
  const char* const begin = after_blanks(cursor, end, separator);
  const bool quoted = begin != end && *begin == '"';
  // A number may hold its mark, so the field does not end with it where fields are separated by the same character.
  const bool may_hold_separator = separator == static_cast<char>(mark);
  const char* after = may_hold_separator ? nullptr : number_end(begin + (quoted ? 1 : 0), end, mark, value);
  if (after != nullptr && std::isfinite(value) && (!quoted || (after != end && *after == '"'))) {
    after = after_blanks(after + (quoted ? 1 : 0), end, separator);
    if (after == end || *after == separator || *after == '\n') {
      cursor = after;
      return Cell::number;
    }
  }
  const char* const field = std::exchange(cursor, field_end(begin, end, separator));
  const std::string_view text = bare(std::string_view(field, cursor - field));
  if (text.empty()) return Cell::missing;
  if (says_missing(text)) return Cell::marked;
  if (numbers.thousands && is_number_with_thousands(text, mark, value)) return Cell::number;
  if (!is_number(text, mark, value)) {
    if (is_number_with_other_mark(text, mark)) return Cell::other_mark;
    return has_thousands(text, mark) ? Cell::thousands : Cell::word;
  }
  return std::isfinite(value) ? Cell::number : Cell::infinite;
}

bool has_other_mark(std::string_view field, DecimalMark mark) {
  double value = 0.0;
  return !is_number(bare(field), mark, value) && is_number_with_other_mark(bare(field), mark);
}

bool may_have_thousands(std::string_view field, DecimalMark mark) { return has_thousands(bare(field), mark); }

std::string problem_of(std::string_view field, DecimalMark mark) {
  const std::string_view text = bare(field);
  if (text.empty()) return "the cell is empty, a number is needed";
  double value = 0.0;
  if (is_number(text, mark, value)) return fmt::format("'{}' is not finite", shortened(text));
  const char* const separator = mark == DecimalMark::point ? "comma" : "point";
  if (has_thousands(text, mark) && is_number_with_other_mark(text, mark)) {
    return fmt::format("'{}' has a {}, which may be a separator of thousands or a decimal {}", shortened(text),
                       separator, separator);
  }
  if (has_thousands(text, mark)) return fmt::format("'{}' has separators of thousands", shortened(text));
  if (is_number_with_other_mark(text, mark)) {
    return fmt::format("'{}' has a decimal {}, and a decimal {} is expected", shortened(text),
                       mark == DecimalMark::point ? "comma" : "point", mark == DecimalMark::point ? "point" : "comma");
  }
  return fmt::format("'{}' is not a number", shortened(text));
}

}  // namespace llmt::csv
