#include "trees/series_table.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <regex>
#include <set>
#include <stdexcept>

#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

// First rows of the records. Rows of a record stand together.
std::vector<Eigen::Index> record_begins(const Csv& csv, const std::string& column) {
  if (column.empty()) return {};
  const std::vector<std::string> words = csv.texts(column);
  std::vector<Eigen::Index> begins;
  std::set<std::string> seen;
  for (std::size_t row = 0; row < words.size(); ++row) {
    const auto here = static_cast<Eigen::Index>(row);
    if (words[row].empty()) {
      throw std::runtime_error(fmt::format("{}:{}: column \"{}\" says the record of each row and is empty here",
                                           csv.name(), csv.line_of(here), column));
    }
    if (row > 0 && words[row] == words[row - 1]) continue;
    if (!seen.insert(words[row]).second) {
      throw std::runtime_error(
          fmt::format("{}:{}: column \"{}\": the record {} goes on here, behind another one; sort the rows", csv.name(),
                      csv.line_of(here), column, words[row]));
    }
    begins.push_back(here);
  }
  return begins;
}

// The row that a message of the library names, as a line of the file.
[[noreturn]] void refuse_times(const Csv& csv, const std::string& column, const std::invalid_argument& error) {
  std::string text = error.what();
  std::smatch found;
  if (std::regex_search(text, found, std::regex("row ([0-9]+)"))) {
    const Eigen::Index line = csv.line_of(std::stol(found[1]));
    text = found.prefix().str() + fmt::format("line {}", line) + found.suffix().str();
  }
  throw std::runtime_error(
      fmt::format("{}: column \"{}\": {}; --grid STEP interpolates to equal steps, --groups says where a record begins",
                  csv.name(), column, text));
}

}  // namespace

SeriesTable read_series(const Csv& csv, const SeriesColumns& columns, bool may_lack_outputs) {
  if (csv.rows() == 0) throw std::runtime_error(fmt::format("{}: there is a header and no rows", csv.name()));
  SeriesTable table;
  Series& series = table.series;
  series.input_names = columns.inputs;
  series.output_names = columns.outputs;
  series.inputs =
      columns.inputs.empty() ? Eigen::MatrixXd(csv.rows(), 0) : csv.numbers_or_missing(columns.inputs, columns.threads);
  series.outputs.setConstant(csv.rows(), std::ssize(columns.outputs), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t o = 0; o < columns.outputs.size(); ++o) {
    if (may_lack_outputs && !csv.has(columns.outputs[o])) continue;
    const std::vector<std::string> name = {columns.outputs[o]};
    series.outputs.col(static_cast<Eigen::Index>(o)) = csv.numbers_or_missing(name, columns.threads);
  }
  series.record_begins = record_begins(csv, columns.groups);
  std::vector<Eigen::Index> rows(csv.rows());
  std::iota(rows.begin(), rows.end(), Eigen::Index{0});
  table.lines = csv.lines_of(rows);
  if (columns.time.empty()) {
    if (columns.grid > 0.0) throw std::invalid_argument("--grid needs the times of the rows: give --time");
    return table;
  }
  const Eigen::VectorXd times = csv.numbers(columns.time, columns.threads);
  try {
    if (columns.grid > 0.0) {
      series = on_grid(series, times, columns.grid, 5.0 * columns.grid);
      table.lines.clear();
    } else if (csv.rows() > 1) {
      series.sample_time = sample_time_of(times, records_of(series));
    }
  } catch (const std::invalid_argument& error) {
    refuse_times(csv, columns.time, error);
  }
  return table;
}

}  // namespace llmt::apps
