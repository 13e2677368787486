#include "report/table/named_inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "llmt/names.hpp"

namespace llmt::report {
namespace {

// Whether the values are different whole numbers that rise or fall from row to row, or of many rows consecutive ones in
// another order.
bool numbers_the_rows(const Eigen::Ref<const Eigen::VectorXd>& values) {
  constexpr Eigen::Index fewest = 20;
  constexpr Eigen::Index fewest_in_disorder = 100;
  constexpr double largest = 9007199254740992.0;  // 2^53
  if (values.size() < fewest) return false;
  for (const double value : values) {
    if (!(std::abs(value) < largest) || value != std::floor(value)) return false;
  }
  bool rises = true;
  bool falls = true;
  for (Eigen::Index i = 1; i < values.size(); ++i) {
    rises = rises && values(i) > values(i - 1);
    falls = falls && values(i) < values(i - 1);
  }
  if (rises || falls) return true;
  if (values.size() < fewest_in_disorder) return false;
  std::vector<double> sorted(values.begin(), values.end());
  std::ranges::sort(sorted);
  const double step = sorted[1] - sorted[0];
  for (std::size_t k = 1; k < sorted.size(); ++k) {
    if (step == 0.0 || sorted[k] - sorted[k - 1] != step) return false;
  }
  return true;
}

// "2024-03-31", "31.3.24", "3/31/2024 14:05": three numbers of at most four digits, and perhaps a time of day.
bool looks_like_a_date(const std::string& text) {
  std::size_t at = 0;
  std::size_t longest = 0;
  char mark = '\0';
  for (int part = 0; part < 3; ++part) {
    const std::size_t begin = at;
    while (at < text.size() && text[at] >= '0' && text[at] <= '9') ++at;
    if (at == begin || at - begin > 4) return false;
    if (part < 2 && text.find_first_not_of('0', begin) >= at) return false;  // there is no month 0
    longest = std::max(longest, at - begin);
    if (part == 2) break;
    if (at == text.size() || std::string_view("-/.").find(text[at]) == std::string_view::npos) return false;
    if (part == 1 && text[at] != mark) return false;
    mark = text[at++];
  }
  const bool ends = at == text.size() || text[at] == 'T' || text[at] == ' ';
  return ends && (longest == 4 || longest == 2);
}

// A cell of words that begins or ends with a number's text.
struct Written {
  std::string before;
  std::string number;  // digits, a sign, decimal marks and marks of thousands
  std::string behind;

  bool operator==(const Written&) const = default;
};

// What sets thousands apart in numbers that are no numbers for a reader: apostrophes and blanks.
constexpr std::array<std::string_view, 7> thousands_marks = {"'",      "\u2019", " ",     "\u00a0",
                                                             "\u202f", "\u2009", "\u00b4"};

// The mark of thousands that stands at a place of a text, before three digits; empty if there is none.
std::string_view thousands_mark_at(std::string_view text, std::size_t at) {
  const auto is_digit = [&](std::size_t place) {
    return place < text.size() && text[place] >= '0' && text[place] <= '9';
  };
  for (const std::string_view mark : thousands_marks) {
    if (!text.substr(at).starts_with(mark)) continue;
    const std::size_t next = at + mark.size();
    if (is_digit(next) && is_digit(next + 1) && is_digit(next + 2) && !is_digit(next + 3)) return mark;
  }
  return {};
}

std::string without_outer_blanks(std::string_view text) {
  constexpr std::string_view no_break = "\u00a0";
  for (bool again = true; again;) {
    again = false;
    for (const std::string_view blank : {std::string_view(" "), no_break, std::string_view("\u202f")}) {
      if (text.starts_with(blank)) text.remove_prefix(blank.size()), again = true;
      if (text.ends_with(blank)) text.remove_suffix(blank.size()), again = true;
    }
  }
  return std::string(text);
}

// The parts of a text with one number in it; nothing if there is none.
std::optional<Written> written(const std::string& text) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto first = std::ranges::find_if(text, is_digit);
  if (first == text.end()) return std::nullopt;
  std::size_t begin = static_cast<std::size_t>(first - text.begin());
  if (begin > 0 && (text[begin - 1] == '-' || text[begin - 1] == '+')) --begin;
  std::size_t end = begin + 1;
  while (end < text.size()) {
    const bool is_mark = (text[end] == '.' || text[end] == ',') && end + 1 < text.size() && is_digit(text[end + 1]);
    if (const std::string_view mark = thousands_mark_at(text, end); !mark.empty()) {
      end += mark.size();
    } else if (is_digit(text[end]) || is_mark) {
      ++end;
    } else if ((text[end] == 'e' || text[end] == 'E') && end + 1 < text.size() && is_digit(text[end + 1])) {
      ++end;
    } else {
      break;
    }
  }
  const std::string_view whole(text);
  Written result{without_outer_blanks(whole.substr(0, begin)), text.substr(begin, end - begin),
                 without_outer_blanks(whole.substr(end))};
  return std::ranges::any_of(result.behind, is_digit) && result.behind.find(' ') != std::string::npos
             ? std::nullopt
             : std::optional(result);
}

std::string_view thousands_in(const std::string& number) {
  for (std::size_t at = 1; at < number.size(); ++at) {
    if (const std::string_view mark = thousands_mark_at(number, at); !mark.empty()) return mark;
  }
  return {};
}

bool is_currency_sign(const std::string& text) {
  constexpr std::array<std::string_view, 6> signs = {"$", "\u20ac", "\u00a3", "\u00a5", "\u20b9", "\u20bd"};
  return std::ranges::find(signs, text) != signs.end();
}

// What all texts are, such as `a number and "kg"`; empty if they are no numbers that are written in one way. Letters
// before whole numbers are names: "P1", "P2".
std::string common_writing(const std::vector<std::string>& texts) {
  if (texts.size() < 2) return "";
  std::optional<Written> first = written(texts.front());
  if (!first) return "";
  std::string_view thousands;
  bool has_fraction = false;
  for (const std::string& text : texts) {
    const std::optional<Written> parts = written(text);
    if (!parts || parts->before != first->before || parts->behind != first->behind) return "";
    if (thousands.empty()) thousands = thousands_in(parts->number);
    has_fraction = has_fraction || parts->number.find_first_of(".,") != std::string::npos;
  }
  const bool is_name = !first->before.empty() && !is_currency_sign(first->before) && !has_fraction && thousands.empty();
  if (is_name || (first->before.empty() && first->behind.empty() && thousands.empty())) return "";
  std::string result = first->before.empty() ? "" : fmt::format("\"{}\" and ", first->before);
  result += "a number";
  if (!first->behind.empty()) result += fmt::format(" and \"{}\"", first->behind);
  if (!thousands.empty()) {
    result += thousands == "'" || thousands == "\u2019" || thousands == "\u00b4" ? " with apostrophes between thousands"
                                                                                 : " with blanks between thousands";
  }
  return result;
}

}  // namespace

std::vector<int> positions_of(const std::string& option, const std::vector<std::string>& names,
                              const std::vector<std::string>& inputs) {
  std::vector<int> result;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(inputs, name);
    if (found == inputs.end()) {
      throw std::invalid_argument(fmt::format("{} has \"{}\", which is not among the inputs {}{}", option, name,
                                              fmt::join(inputs, ", "), did_you_mean(name, inputs)));
    }
    result.push_back(static_cast<int>(found - inputs.begin()));
  }
  return result;
}

std::vector<int> signs_of(const std::string& option, const std::vector<std::string>& names,
                          const std::vector<std::string>& inputs) {
  if (names.empty()) return {};
  std::vector<int> result(inputs.size(), 0);
  for (const std::string& name : names) {
    const bool falls = std::ranges::find(inputs, name) == inputs.end() && name.starts_with('-');
    const int position = positions_of(option, {falls ? name.substr(1) : name}, inputs).front();
    int& sign = result[position];
    if (sign == (falls ? 1 : -1)) {
      throw std::invalid_argument(fmt::format("{} names \"{}\" with both signs", option, inputs[position]));
    }
    sign = falls ? -1 : 1;
  }
  return result;
}

std::string far_value(const Eigen::Ref<const Eigen::VectorXd>& values) {
  constexpr Eigen::Index fewest = 3;
  constexpr Eigen::Index fewest_others = 10;
  constexpr double far = 3.0;  // of the range of all others: designed settings, such as 0, 2.4 and 5, are not so far
  std::vector<double> sorted;
  for (const double value : values) {
    if (!std::isnan(value)) sorted.push_back(value);
  }
  std::ranges::sort(sorted);
  const Eigen::Index count = std::ssize(sorted);
  for (const bool is_smallest : {true, false}) {
    if (count == 0) break;
    const double value = is_smallest ? sorted.front() : sorted.back();
    const auto [begin, end] = std::ranges::equal_range(sorted, value);
    const Eigen::Index equal = end - begin;
    if (equal < fewest || 100 * equal < count || count - equal < fewest_others || 2 * equal > count) continue;
    const double low = is_smallest ? *end : sorted.front();
    const double high = is_smallest ? sorted.back() : *(begin - 1);
    const double gap = is_smallest ? low - value : value - high;
    if (high > low && gap > far * (high - low)) {
      return fmt::format("{} of {} cells are {:.10g}, far from all others ({:.4g} to {:.4g})", equal, count, value, low,
                         high);
    }
  }
  return "";
}

bool are_dates(const std::vector<std::string>& levels) {
  return levels.size() > 1 && std::ranges::all_of(levels, looks_like_a_date);
}

std::optional<AccidentalInput> accidental_words(const std::vector<std::string>& levels, Eigen::Index rows) {
  using Kind = AccidentalInput::Kind;
  constexpr std::size_t most_levels = 20;
  constexpr double most_levels_per_row = 0.1;
  constexpr double levels_per_row_of_names = 0.5;
  const double per_row = static_cast<double>(levels.size()) / static_cast<double>(rows);
  const bool few = levels.size() <= most_levels || per_row <= most_levels_per_row;
  const bool dates = are_dates(levels);
  if (std::string writing = dates ? "" : common_writing(levels); !writing.empty()) {
    return AccidentalInput{.kind = Kind::unit, .detail = std::move(writing)};
  }
  if (!dates && few) return std::nullopt;
  const bool is_left_out = !few && (dates || per_row > levels_per_row_of_names);
  return AccidentalInput{.kind = dates ? Kind::dates : Kind::words, .is_left_out = is_left_out};
}

std::vector<AccidentalInput> accidental_inputs(const InputColumns& inputs) {
  using Kind = AccidentalInput::Kind;
  std::vector<AccidentalInput> found;
  for (const int column : inputs.categorical) {
    if (const auto words = accidental_words(inputs.levels[column], inputs.values.rows())) {
      found.push_back(*words);
      found.back().input = column;
    }
  }
  for (int column = 0; column < inputs.values.cols(); ++column) {
    if (!inputs.levels[column].empty()) continue;
    if (numbers_the_rows(inputs.values.col(column))) found.push_back({Kind::row_numbers, column});
    if (std::string far = far_value(inputs.values.col(column)); !far.empty()) {
      found.push_back({Kind::far_value, column, std::move(far)});
    }
  }
  return found;
}

}  // namespace llmt::report
