// CSV text: a table read whole and the same table read in pieces hold the same.
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "fuzz/fuzz.hpp"
#include "llmt/csv.hpp"

namespace fuzz_csv {
namespace {

struct Outcome {
  std::vector<std::string> rows;  // line, text, numbers and words of each
  std::string error;              // or none
};

void add_rows(const llmt::Csv& csv, std::vector<std::string>& rows) {
  const std::size_t before = rows.size();
  const llmt::CsvNumbers numbers = csv.read_numbers(csv.columns(), 1);
  for (Eigen::Index row = 0; row < csv.rows(); ++row) {
    std::string& text = rows.emplace_back(fmt::format("{}|{}", csv.line_of(row), csv.row_text(row)));
    for (Eigen::Index column = 0; column < numbers.values.cols(); ++column) {
      text += fmt::format("|{}", numbers.values(row, column));
    }
  }
  csv.visit_texts(csv.columns(), [&](Eigen::Index row, std::size_t, std::string_view cell) {
    rows[before + row] += fmt::format("|{}", cell);
  });
}

// A row that lacks fields and that nothing but blank lines follow is known to be the last one by a reader of the whole
// text alone.
std::string without_hint(std::string message) {
  constexpr std::string_view hint = " (is the file cut off?)";
  if (message.ends_with(hint)) message.resize(message.size() - hint.size());
  return message;
}

Outcome whole(const std::string& text) {
  Outcome outcome;
  try {
    add_rows(llmt::Csv::parse(text, "t"), outcome.rows);
  } catch (const std::runtime_error& error) {
    outcome.error = without_hint(error.what());
  }
  return outcome;
}

Outcome in_pieces(const std::string& text, std::size_t bytes) {
  Outcome outcome;
  std::istringstream stream(text);
  llmt::CsvPieces pieces(stream, "t", bytes);
  try {
    while (const std::optional<llmt::Csv> piece = pieces.next()) {
      fuzz::require(piece->rows() > 0, "a piece has rows");
      add_rows(*piece, outcome.rows);
    }
  } catch (const std::runtime_error& error) {
    outcome.error = without_hint(error.what());
  }
  return outcome;
}

}  // namespace

FUZZ_TARGET(csv) {
  const std::string text = fuzz::text_of(data, size);
  const Outcome expected = whole(text);
  for (const std::size_t bytes : {std::size_t{1}, 1 + size % 17, size + 1}) {
    const Outcome outcome = in_pieces(text, bytes);
    // The rows of a whole table are counted before its cells are read, so a wrong row behind a cell that is not UTF-8
    // is said first.
    const bool is_cell = outcome.error.ends_with("not UTF-8") && !expected.error.empty();
    // That nothing follows the header, and why, is known to a reader of the whole text alone.
    const bool is_header_alone = (!outcome.error.empty() || outcome.rows.empty()) &&
                                 (expected.error.find("lines end with") != std::string::npos ||
                                  expected.error.find("a quote is left open") != std::string::npos);
    fuzz::require(is_cell || is_header_alone || outcome.error == expected.error,
                  fmt::format("pieces of {} bytes say '{}', the whole '{}'", bytes, outcome.error, expected.error));
    // Rows before an error have been handed out.
    if (expected.error.empty()) {
      fuzz::require(outcome.rows == expected.rows, fmt::format("pieces of {} bytes are together the whole", bytes));
    }
  }
  return 0;
}

}  // namespace fuzz_csv
