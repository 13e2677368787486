#include "shared/table_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "llmt/files.hpp"
#include "llmt/limits.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

constexpr const char* standard_input = "standard input";

// True if the header has only numbers, and these do not count the columns from 0 or 1 on.
bool looks_like_a_row(const Csv& csv) {
  std::vector<double> numbers;
  for (std::string name : csv.columns()) {
    std::ranges::replace(name, static_cast<char>(csv.decimal_mark()), '.');
    double value = 0.0;
    const char* const end = name.data() + name.size();
    const auto [stop, error] = std::from_chars(name.data(), end, value);
    if (error != std::errc() || stop != end) return false;
    numbers.push_back(value);
  }
  const bool counts =
      std::ranges::adjacent_find(numbers, [](double one, double next) { return next != one + 1.0; }) == numbers.end() &&
      (numbers.front() == 0.0 || numbers.front() == 1.0);
  return !counts;
}

// A brace, then a quote or the other brace.
bool begins_like_json(std::string_view text) {
  constexpr std::string_view blanks = " \t\r\n";
  const std::size_t brace = text.find_first_not_of(blanks);
  if (brace == std::string_view::npos || text[brace] != '{') return false;
  const std::size_t next = text.find_first_not_of(blanks, brace + 1);
  return next != std::string_view::npos && (text[next] == '"' || text[next] == '}');
}

// Standard input as far as half of the memory, as a file. Errors of reading name it.
std::string read_standard_input() {
  const std::uintmax_t memory = static_cast<std::uintmax_t>(::sysconf(_SC_PHYS_PAGES)) * ::sysconf(_SC_PAGESIZE);
  const std::string path = "/dev/stdin";
  try {
    return read_file(path, {.bytes = memory / 2, .line_bytes = most(Limit::table_line)});
  } catch (const std::runtime_error& error) {
    const std::string message = error.what();
    throw std::runtime_error(message.starts_with(path) ? standard_input + message.substr(path.size()) : message);
  }
}

}  // namespace

bool is_json_file(const std::string& path) {
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown)) return false;
  std::ifstream file(path, std::ios::binary);
  std::string begin(256, '\0');
  file.read(begin.data(), std::ssize(begin));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  return begins_like_json(begin);
}

std::string table_name(const std::string& path) { return path == "-" ? standard_input : path; }

Csv read_table(const std::string& path, DecimalMark mark, bool thousands) {
  const auto refuse_json = [&](bool is_json) {
    if (is_json) throw std::runtime_error(table_name(path) + ": this is a JSON file; a table (CSV) is expected");
  };
  std::string from_stdin;
  if (path == "-") {
    from_stdin = read_standard_input();
    refuse_json(begins_like_json(from_stdin));
  } else {
    refuse_json(is_json_file(path));
  }
  Csv csv = path != "-" ? Csv::read(path, mark) : Csv::parse(std::move(from_stdin), table_name(path), mark);
  if (thousands) csv.read_thousands();
  if (looks_like_a_row(csv)) {
    warn(
        fmt::format("llmt: {}: the first line holds only numbers and was taken for the names of the columns; if it is "
                    "a row of data, put a line with names above it",
                    csv.name()));
  }
  return csv;
}

}  // namespace llmt::apps
