#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "llmt/robotics/mechanism/mechanism_file.hpp"

namespace llmt::robotics {
namespace {

// Suffixes of columns, and their factors to the coordinate's unit.
const std::map<std::string, double>& suffixes_of(const std::string& unit) {
  static const std::map<std::string, double> lengths = {{"_mm", 1.0}, {"_m", 1000.0}, {"_um", 0.001}};
  static const std::map<std::string, double> angles = {{"_deg", 1.0}, {"_rad", 180.0 / std::numbers::pi}};
  static const std::map<std::string, double> numbers = {{"", 1.0}};
  return unit == "mm" ? lengths : unit == "deg" ? angles : numbers;
}

std::vector<std::string> columns_for(const Coordinate& coordinate) {
  std::vector<std::string> columns;
  for (const auto& [suffix, factor] : suffixes_of(coordinate.unit)) columns.push_back(coordinate.name + suffix);
  return columns;
}

// The column of a coordinate, or an empty text.
std::string column_of(const Csv& csv, const Coordinate& coordinate) {
  const std::vector<std::string> own = columns_for(coordinate);
  std::string found;
  for (const std::string& column : own) {
    if (!csv.has(column)) continue;
    if (!found.empty()) {
      throw std::runtime_error(fmt::format("{}:1: columns {} and {} are one coordinate", csv.name(), found, column));
    }
    found = column;
  }
  for (const char* suffix : {"", "_mm", "_m", "_um", "_deg", "_rad"}) {
    const std::string other = coordinate.name + suffix;
    if (!found.empty() || !csv.has(other)) continue;
    throw std::runtime_error(fmt::format("{}:1: column \"{}\" has {}, name it {}", csv.name(), other,
                                         *suffix == '\0' ? "no unit" : "a wrong unit", fmt::join(own, " or ")));
  }
  return found;
}

}  // namespace

MechanismTable read_mechanism_table(const std::string& path, const Mechanism& mechanism, DecimalMark mark) {
  const Csv csv = Csv::read(path, mark);
  std::vector<std::string> columns;
  std::vector<Eigen::Index> places;
  Eigen::VectorXd factors = Eigen::VectorXd::Zero(std::ssize(mechanism.coordinates));
  std::vector<std::string> wanted;
  for (std::size_t i = 0; i < mechanism.coordinates.size(); ++i) {
    const Coordinate& coordinate = mechanism.coordinates[i];
    wanted.push_back(columns_for(coordinate).front());
    const std::string column = column_of(csv, coordinate);
    if (column.empty()) continue;
    columns.push_back(column);
    places.push_back(static_cast<Eigen::Index>(i));
    factors(places.back()) = suffixes_of(coordinate.unit).at(column.substr(coordinate.name.size()));
  }
  if (columns.empty()) {
    throw std::runtime_error(
        fmt::format("{}:1: no column is a coordinate of {}: {}", path, mechanism.name, fmt::join(wanted, ", ")));
  }
  if (csv.rows() == 0) throw std::runtime_error(path + ": there is no pose below the header");
  MechanismTable table{.values = Eigen::MatrixXd::Constant(csv.rows(), std::ssize(mechanism.coordinates), NAN),
                       .lines = {},
                       .unused = {}};
  // Only an empty cell is a reading that there is not: NaN is what programs write where something failed.
  const CsvNumbers cells = csv.read_numbers(columns);
  std::vector<Eigen::Index> bad;
  for (const ColumnCells& column : cells.cells) bad.push_back(std::min(column.first_marked, column.first_other));
  csv.refuse_first(columns, bad);
  const Eigen::MatrixXd& read = cells.values;
  for (std::size_t k = 0; k < places.size(); ++k) {
    table.values.col(places[k]) = factors(places[k]) * read.col(static_cast<Eigen::Index>(k));
  }
  std::vector<Eigen::Index> rows(csv.rows());
  for (Eigen::Index row = 0; row < csv.rows(); ++row) rows[row] = row;
  table.lines = csv.lines_of(rows);
  for (const std::string& column : csv.columns()) {
    if (std::ranges::find(columns, column) == columns.end()) table.unused.push_back(column);
  }
  return table;
}

std::string to_csv(const Mechanism& mechanism, const Eigen::MatrixXd& poses, const std::vector<std::string>& names) {
  std::vector<Eigen::Index> places;
  std::string text;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(mechanism.coordinates, name, &Coordinate::name);
    if (found == mechanism.coordinates.end()) {
      throw std::invalid_argument(fmt::format("llmt::robotics::to_csv: {} has no coordinate {}", mechanism.name, name));
    }
    places.push_back(found - mechanism.coordinates.begin());
    text += fmt::format("{}{}{}", places.size() > 1 ? "," : "", name, found->unit == "1" ? "" : "_" + found->unit);
  }
  text += '\n';
  for (Eigen::Index row = 0; row < poses.rows(); ++row) {
    for (std::size_t k = 0; k < places.size(); ++k) {
      const double value = poses(row, places[k]);
      text += fmt::format("{}{}", k > 0 ? "," : "", std::isnan(value) ? "" : fmt::format("{}", value));
    }
    text += '\n';
  }
  return text;
}

}  // namespace llmt::robotics
