#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <regex>
#include <stdexcept>

#include "kinematics/units.hpp"
#include "llmt/robotics/chain.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

namespace {

struct Columns {
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> cells;  // by column

  void add(const std::string& name, const Eigen::VectorXd& values) {
    names.push_back(name);
    cells.emplace_back();
    for (const double value : values) cells.back().push_back(fmt::format("{}", value));
  }
};

// RFC 4180.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + '"';
}

// "one" of the base "known sphere one".
std::string name_of_feature(const Observation& seen) {
  const std::size_t first = is_known_sphere(seen.base) ? seen.base.find(' ') + 1 : 0;
  return quoted(seen.base.substr(seen.base.find(' ', first) + 1));
}

std::string target_of(const Observation& seen) {
  if (seen.base.empty() || is_touched(seen.base)) return seen.tool;
  const std::string prefix = seen.base + "/";
  return seen.tool.starts_with(prefix) ? seen.tool.substr(prefix.size()) : seen.tool == seen.base ? "" : seen.tool;
}

// A row of a socket has its name, and no measured point.
void add_sockets(const std::vector<Observation>& observations, Columns& columns) {
  if (std::ranges::none_of(observations, [](const Observation& seen) { return is_socket(seen.base); })) return;
  columns.names.emplace_back("socket");
  std::vector<std::string>& names = columns.cells.emplace_back();
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const bool in_socket = is_socket(observations[i].base);
    names.push_back(in_socket ? name_of_feature(observations[i]) : "");
    for (const char* axis : {"x_mm", "y_mm", "z_mm"}) {
      const auto column = std::ranges::find(columns.names, axis);
      if (in_socket) columns.cells[column - columns.names.begin()][i].clear();
    }
  }
}

std::vector<JointColumn> columns_of(const Chain& chain) {
  std::vector<JointColumn> columns;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const std::string unit = chain.joints[j].type == JointType::revolute ? "rad" : "mm";
    columns.push_back({fmt::format("q{}_{}", j + 1, unit), unit});
  }
  return columns;
}

// One column of names; the chain's own frame gets a name that no other has. Nothing if there is no other.
void add_names(const std::string& column, std::string own, const std::vector<std::string>& names, Columns& columns) {
  if (std::ranges::all_of(names, [](const std::string& name) { return name.empty(); })) return;
  while (std::ranges::find(names, own) != names.end()) own += '_';
  columns.names.push_back(column);
  columns.cells.emplace_back();
  for (const std::string& name : names) columns.cells.back().push_back(quoted(name.empty() ? own : name));
}

}  // namespace

std::vector<JointColumn> joint_columns(const Chain& chain) {
  static const std::regex other("q[0-9]+|r?[xyz]|t[0-9]+_[xyz]|distance|radius|(sigma|U95)(_[xyz])?|qmeas[0-9]+");
  std::vector<JointColumn> by_name;
  std::vector<JointColumn> by_number;
  bool has_names = true;
  for (const Joint& joint : chain.joints) {
    const std::string number = fmt::format("q{}", by_number.size() + 1);
    has_names = has_names && (joint.name == number || !std::regex_match(joint.name, other));
    const std::string unit = limit_unit(joint);
    by_name.push_back({fmt::format("{}_{}", joint.name, unit), unit});
    by_number.push_back({fmt::format("{}_{}", number, unit), unit});
  }
  return has_names ? by_name : by_number;
}

Eigen::VectorXd in_unit_of(const JointColumn& column, const Eigen::VectorXd& values) {
  static const std::map<std::string, double> factors = {
      {"rad", 1.0}, {"deg", degrees}, {"mm", 1.0}, {"m", 1e-3}, {"um", 1e3}};
  const auto factor = factors.find(column.unit);
  if (factor == factors.end()) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::in_unit_of: column \"{}\" has the unit \"{}\"; known: rad, "
                    "deg, mm, m, um",
                    column.name, column.unit));
  }
  if (factor->second == 1.0) return values;
  return (factor->second * values).unaryExpr([](double value) { return std::stod(fmt::format("{:.15g}", value)); });
}

std::string csv_field(const std::string& name) {
  return name.find_first_of(",;\t\"\r\n") == std::string::npos ? name : quoted(name);
}

std::string to_csv(const Measurements& all, const Robot& robot, const std::vector<JointColumn>& joint_columns) {
  validate(all, robot);
  if (!joint_columns.empty() && joint_columns.size() != robot.chain.joints.size()) {
    throw std::invalid_argument(fmt::format("llmt::robotics::to_csv: there are {} columns of {} joints",
                                            joint_columns.size(), robot.chain.joints.size()));
  }
  // Orientations stand beside their positions.
  const Measurements measurements = orientation_rows(all.poses).empty() ? all : select(all, position_rows(all.poses));
  Columns columns;
  Eigen::Index joint = 0;
  for (const JointColumn& column : joint_columns.empty() ? columns_of(robot.chain) : joint_columns) {
    const Eigen::VectorXd values = measurements.poses.joints.col(joint++);
    if (!column.name.empty()) columns.add(csv_field(column.name), in_unit_of(column, values));
  }
  const std::vector<Observation>& observations = measurements.poses.observations;
  const bool distances = !observations.empty() && observations.front().reading == Reading::distance;
  const std::string base = observations.empty() ? "" : observations.front().base;
  const bool planes = is_plane(base);
  const bool spheres = is_sphere(base) || is_known_sphere(base);
  if (distances && !is_sphere(base)) {
    columns.add(is_known_sphere(base) ? "radius_mm" : "distance_mm", measurements.positions_mm.col(0));
  }
  if (planes || spheres) {
    columns.names.emplace_back(planes ? "plane" : "sphere");
    columns.cells.emplace_back();
    for (const Observation& seen : observations) columns.cells.back().push_back(name_of_feature(seen));
  }
  for (std::size_t axis = 0; axis < 3 && !distances && !planes; ++axis) {
    if (measurements.measured[axis])
      columns.add(fmt::format("{}_mm", "xyz"[axis]), measurements.positions_mm.col(axis));
  }
  const bool angles = measurements.orientation.kind == Orientation::Kind::angles_deg;
  for (Eigen::Index k = 0; k < measurements.orientation.values.cols(); ++k) {
    columns.add(angles ? fmt::format("r{}_deg", "xyz"[k]) : fmt::format("q{}", "wxyz"[k]),
                measurements.orientation.values.col(k));
  }
  std::vector<std::string> sessions;
  std::vector<std::string> targets;
  for (const Observation& seen : observations) {
    sessions.push_back(is_touched(seen.base) ? "" : seen.base);
    targets.push_back(target_of(seen));
  }
  add_sockets(observations, columns);
  add_names("session", all.session.empty() ? "first" : all.session, sessions, columns);
  add_names("target", all.target.empty() ? "t1" : all.target, targets, columns);
  for (const auto& [name, values] : measurements.poses.covariates) {
    if (!is_move(name)) columns.add(name, values);
  }
  std::string text = fmt::format("{}\n", fmt::join(columns.names, ","));
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    for (std::size_t c = 0; c < columns.cells.size(); ++c) {
      text += fmt::format("{}{}", c == 0 ? "" : ",", columns.cells[c][i]);
    }
    text += '\n';
  }
  return text;
}

}  // namespace llmt::robotics
