#include "report/table/named_inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <string_view>

#include "llmt/names.hpp"

namespace llmt::report {
namespace {

// Whether the values are consecutive whole numbers, row by row.
bool numbers_the_rows(const Eigen::Ref<const Eigen::VectorXd>& values) {
  constexpr Eigen::Index fewest = 20;
  if (values.size() < fewest || (values(0) != 0.0 && values(0) != 1.0)) return false;
  for (Eigen::Index i = 1; i < values.size(); ++i) {
    if (values(i) != values(i - 1) + 1.0) return false;
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

// The text behind the number that a text begins with; empty if it begins with none, or has nothing behind it.
std::string unit_behind_number(const std::string& text) {
  double value = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return "";
  const std::size_t end = text.find_first_not_of(' ', stop - text.data());
  return end == std::string::npos ? "" : text.substr(end);
}

// The unit that all texts have behind a number; empty if there is none.
std::string common_unit(const std::vector<std::string>& texts) {
  const std::string unit = texts.empty() ? "" : unit_behind_number(texts.front());
  const auto has_it = [&](const std::string& text) { return unit_behind_number(text) == unit; };
  return texts.size() > 1 && std::ranges::all_of(texts, has_it) ? unit : "";
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

std::vector<AccidentalInput> accidental_inputs(const InputColumns& inputs) {
  constexpr std::size_t most_levels = 20;
  constexpr double most_levels_per_row = 0.1;
  std::vector<AccidentalInput> found;
  for (const int column : inputs.categorical) {
    const std::size_t levels = inputs.levels[column].size();
    const auto rows = static_cast<double>(inputs.values.rows());
    const bool few = levels <= most_levels || static_cast<double>(levels) <= most_levels_per_row * rows;
    const bool dates = std::ranges::all_of(inputs.levels[column], looks_like_a_date);
    if (const std::string unit = common_unit(inputs.levels[column]); !dates && !unit.empty()) {
      found.push_back({AccidentalInput::Kind::unit, column, unit});
    } else if (dates || !few) {
      found.push_back({dates ? AccidentalInput::Kind::dates : AccidentalInput::Kind::words, column});
    }
  }
  for (int column = 0; column < inputs.values.cols(); ++column) {
    if (inputs.levels[column].empty() && numbers_the_rows(inputs.values.col(column))) {
      found.push_back({AccidentalInput::Kind::row_numbers, column});
    }
  }
  return found;
}

}  // namespace llmt::report
