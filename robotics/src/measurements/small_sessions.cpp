#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <set>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {
namespace {

// Bases with more measured coordinates than they and their tools have values, of all bases.
std::map<std::string, bool> told_bases(const Measurements& measurements) {
  std::map<std::string, std::size_t> coordinates;
  std::map<std::string, std::set<std::string>> tools;
  for (const Eigen::Index coordinate : measured_rows(measurements)) {
    const Observation& seen = measurements.poses.observations[coordinate / 3];
    ++coordinates[seen.base];
    tools[seen.base].insert(seen.tool);
  }
  constexpr std::size_t of_base = 6;
  constexpr std::size_t of_tool = 3;
  std::map<std::string, bool> told;
  for (const auto& [base, count] : coordinates) told[base] = count > of_base + of_tool * tools[base].size();
  return told;
}

}  // namespace

Measurements without_small_sessions(const Measurements& measurements) {
  const std::vector<Observation>& observations = measurements.poses.observations;
  if (observations.empty()) return measurements;
  const std::map<std::string, bool> told = told_bases(measurements);
  if (told.size() == 1) return measurements;
  const bool has_lines = !measurements.lines.empty();
  std::vector<Eigen::Index> kept;
  std::set<std::string> left_out;
  std::vector<Eigen::Index> lines;
  for (Eigen::Index row = 0; row < measurements.count(); ++row) {
    const std::string& base = observations[row].base;
    if (told.at(base)) {
      kept.push_back(row);
      continue;
    }
    left_out.insert(base.empty() ? measurements.session : base);
    lines.push_back(has_lines ? measurements.lines[row] : row + 1);
  }
  if (left_out.empty()) return measurements;
  Measurements large = select(measurements, kept);
  large.warnings = measurements.warnings;
  large.unused_columns = measurements.unused_columns;
  large.warnings.push_back(
      fmt::format("{} of {} sessions left out, too few points in each to find where the instrument stood: {} ({}{} {})",
                  left_out.size(), told.size(), fmt::join(left_out, ", "), has_lines ? "line" : "row",
                  lines.size() == 1 ? "" : "s", fmt::join(lines, ", ")));
  return large;
}

}  // namespace llmt::robotics
