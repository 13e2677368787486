#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {
namespace {

// The count of unknowns of a base: a sphere has a centre and a radius, a plane a distance and two angles,
// and the others that are touched have a point.
std::size_t unknowns_of(const std::string& base) {
  constexpr std::size_t of_sphere = 4;
  constexpr std::size_t of_point_or_plane = 3;
  constexpr std::size_t of_instrument = 6;
  if (is_sphere(base)) return of_sphere;
  return is_touched(base) ? of_point_or_plane : of_instrument;
}

// Bases with more measured coordinates than they have unknowns, with those of the tools that are seen from no other, of
// all bases.
std::map<std::string, bool> told_bases(const Measurements& measurements) {
  std::map<std::string, std::size_t> coordinates;
  std::map<std::string, std::set<std::string>> bases_of_tool;
  for (const Eigen::Index coordinate : measured_rows(measurements)) {
    const Observation& seen = measurements.poses.observations[coordinate / 3];
    ++coordinates[seen.base];
    bases_of_tool[seen.tool].insert(seen.base);
  }
  constexpr std::size_t of_tool = 3;
  std::map<std::string, std::size_t> unknowns;
  for (const auto& [base, count] : coordinates) unknowns[base] = unknowns_of(base);
  for (const auto& [tool, bases] : bases_of_tool) {
    if (bases.size() == 1) unknowns[*bases.begin()] += of_tool;
  }
  std::map<std::string, bool> told;
  for (const auto& [base, count] : coordinates) told[base] = count > unknowns[base];
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
  const bool are_sessions = std::ranges::none_of(told, [](const auto& entry) { return is_touched(entry.first); });
  const std::string said =
      fmt::format("{} of {} {} left out, too few points in each to find where {}: {}", left_out.size(), told.size(),
                  are_sessions ? "sessions" : "sessions, sockets, planes and spheres",
                  are_sessions ? "the instrument stood" : "it is", fmt::join(left_out, ", "));
  large.warnings.push_back({"small_sessions",
                            [=](const Face& face) {
                              return fmt::format("{} ({})", said,
                                                 has_lines ? face.rows(lines) : numbered("row", lines));
                            },
                            lines});
  return large;
}

}  // namespace llmt::robotics
