#include <fmt/format.h>
#include <fmt/ranges.h>

#include <numeric>
#include <stdexcept>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/robotics/measurements.hpp"
#include "measurements/header.hpp"
#include "measurements/named_frames.hpp"

namespace llmt::robotics {

namespace {

TargetTable targets_of(const Csv& csv, const Robot& robot, const ColumnMap& given) {
  const ColumnMap map = for_columns_of(csv, given);
  const Header header(csv, robot, {}, map);
  TargetTable targets;
  std::vector<Eigen::Index> rows(csv.rows());
  std::iota(rows.begin(), rows.end(), Eigen::Index{0});
  targets.lines = csv.lines_of(rows);
  if (targets.lines.empty()) throw std::runtime_error(fmt::format("{}: there are no targets", csv.name()));
  if (header.has_joints()) {
    targets.joints = header.joints();
    targets.joint_columns = header.joint_columns();
  }
  if (header.has("x") || header.has("y") || header.has("z")) {
    for (const char* axis : {"x", "y", "z"}) {
      if (!header.has(axis)) {
        throw std::runtime_error(
            fmt::format("{}:1: a target needs x, y and z, there is no column {}_mm", csv.name(), axis));
      }
    }
    std::array<bool, 3> measured = {};
    targets.positions_mm = header.points_mm("", measured);
  }
  if (targets.joints.size() == 0 && targets.positions_mm.size() == 0) {
    throw std::runtime_error(
        fmt::format("{}:1: neither joints (q1_deg, ...) nor positions (x_mm, y_mm, z_mm); columns: {}", csv.name(),
                    fmt::join(csv.columns(), ", ")));
  }
  if (const std::string lack = header.lack_of_orientation(); !lack.empty()) {
    throw std::runtime_error(fmt::format("{}:1: {}", csv.name(), lack));
  }
  for (const std::string& target : header.targets()) {
    if (target.empty()) continue;
    throw std::runtime_error(
        fmt::format("{}:1: column {}x_mm: a target of the tool itself is x_mm, y_mm, z_mm", csv.name(), target));
  }
  const std::vector<Observation> frames =
      known_frames(csv, robot.chain, header.words("session"), header.words("target"));
  for (std::size_t row = 0; row < frames.size(); ++row) {
    if (row == 0) targets.frames = frames.front();
    if (frames[row].base == targets.frames.base && frames[row].tool == targets.frames.tool) continue;
    csv.refuse(static_cast<Eigen::Index>(row), header.words("session").empty() ? "target" : "session",
               "all targets of a file belong to one session and one target: write a file for each");
  }
  for (const char* column : {"target", "session", "reference", "distance", "socket", "plane", "sphere", "radius"}) {
    if (!header.words(column).empty() || header.has(column)) targets.unused_columns.emplace_back(column);
  }
  targets.orientation = header.orientation();
  targets.orientation.convention = map.orientation.empty() ? robot.chain.orientation : map.orientation;
  targets.covariates = header.covariates();
  for (const std::string& column : header.unused()) targets.unused_columns.push_back(column);
  return targets;
}

}  // namespace

TargetTable read_targets(const std::string& path, const Robot& robot, DecimalMark mark, const ColumnMap& map) {
  return targets_of(Csv::read(path, map.decimal.value_or(mark)), robot, map);
}

TargetTable parse_targets(std::string text, const std::string& name, const Robot& robot, DecimalMark mark,
                          const ColumnMap& map) {
  return targets_of(Csv::parse(std::move(text), name, map.decimal.value_or(mark)), robot, map);
}

}  // namespace llmt::robotics
