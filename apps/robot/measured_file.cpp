#include "robot/measured_file.hpp"

#include <fmt/format.h>

#include <set>
#include <stdexcept>

#include "shared/options.hpp"

namespace llmt::apps {

void add_column_map(CLI::App& command, std::string& path) {
  add_input_file(command, "--columns", path, "Column map (YAML): what the columns of the file mean");
}

robotics::ColumnMap column_map(const std::string& path) {
  return path.empty() ? robotics::ColumnMap{} : robotics::read_column_map(path);
}

void add_measured_file_options(CLI::App& command, MeasuredFileOptions& options) {
  add_column_map(command, options.columns);
  command.add_flag("--orientations", options.orientations, "Use the measured orientations as well as the positions");
  add_decimal_comma(command, options.mark);
}

robotics::Measurements read_measured(const std::string& path, const robotics::Robot& robot,
                                     const std::vector<std::string>& also, const MeasuredFileOptions& options) {
  robotics::Measurements measurements =
      robotics::read_measurements(path, robot, also, options.mark, column_map(options.columns));
  if (!options.orientations) return measurements;
  try {
    return robotics::with_orientations(measurements, robot.chain);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: --orientations: {}", path, error.what()));
  }
}

std::string counts_of(const robotics::Measurements& measurements) {
  const robotics::Poses& poses = measurements.poses;
  if (poses.observations.empty()) return fmt::format("{} poses", measurements.count());
  std::set<Eigen::Index> stands;
  std::set<std::string> tools;
  std::set<std::string> bases;
  std::set<std::string> sockets;
  std::set<std::string> planes;
  std::set<std::string> spheres;
  bool distances = false;
  for (const robotics::Observation& seen : poses.observations) {
    stands.insert(seen.stand);
    // A target of another session is called SESSION/TARGET, and has the name of the session where targets have none.
    tools.insert(seen.tool == seen.base                                         ? std::string()
                 : seen.tool.starts_with(seen.base + "/") && !seen.base.empty() ? seen.tool.substr(seen.base.size() + 1)
                                                                                : seen.tool);
    if (robotics::is_socket(seen.base)) {
      sockets.insert(seen.base);
    } else if (robotics::is_plane(seen.base)) {
      planes.insert(seen.base);
    } else if (robotics::is_touched(seen.base)) {
      spheres.insert(seen.base);
    } else {
      bases.insert(seen.base);
      distances = distances || seen.reading == robotics::Reading::distance;
    }
  }
  std::string text = fmt::format("{} poses", stands.size());
  const auto points = std::ssize(robotics::position_rows(poses));
  if (!measurements.target.empty()) {
    tools.erase("");
    tools.insert(measurements.target);
  }
  if (tools.size() > 1) text += fmt::format(", {} points of {} targets", points, tools.size());
  if (distances) text += fmt::format(", {} distances", points);
  if (bases.size() > 1) text += fmt::format(", {} sessions", bases.size());
  const auto add = [&](std::size_t count, const char* what) {
    if (count > 0) text += fmt::format(", {} {}{}", count, what, count == 1 ? "" : "s");
  };
  add(sockets.size(), "socket");
  add(planes.size(), "plane");
  add(spheres.size(), "sphere");
  const auto turns = std::ssize(robotics::orientation_rows(poses));
  if (turns > 0) text += fmt::format(", {} orientations", turns);
  return text;
}

robotics::Measurements points_of(const robotics::Measurements& measurements) {
  if (robotics::orientation_rows(measurements.poses).empty()) return measurements;
  return robotics::select(measurements, robotics::position_rows(measurements.poses));
}

std::string use_of_orientations(const robotics::Measurements& measurements) {
  if (measurements.orientation.values.size() == 0 || !robotics::orientation_rows(measurements.poses).empty()) return "";
  return "The file has orientations. Only the positions are used; --orientations uses both.\n";
}

}  // namespace llmt::apps
