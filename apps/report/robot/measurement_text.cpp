#include "report/robot/measurement_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <vector>

#include "report/text/text.hpp"

namespace llmt::report {

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

std::string still_text(const std::vector<robotics::StillJoint>& still) {
  std::vector<std::string> joints;
  for (const robotics::StillJoint& one : still) {
    joints.push_back(fmt::format("{} ({} {})", one.joint, number(one.range, 2), one.unit));
  }
  return fmt::format(
      "Joints that hardly moved, with their ranges: {}. What only their motion tells stays as described: their axes "
      "and "
      "zeros, and whatever depends on their angles.",
      fmt::join(joints, ", "));
}

Json still_json(const std::vector<robotics::StillJoint>& still) {
  Json joints = Json::array();
  for (const robotics::StillJoint& one : still) {
    joints.push_back({{"joint", one.joint}, {"range", one.range}, {"unit", one.unit}});
  }
  return joints;
}

std::string uncertain_text(const robotics::Robot& robot) {
  const std::vector<discovery::Parameter> all = robotics::parameters(robot);
  std::string text;
  for (const robotics::IdentifiedParameter& one : robotics::uncertain_parameters(robot)) {
    const auto known = std::ranges::find(all, one.name, &discovery::Parameter::name);
    text +=
        fmt::format("{}{} +-{} {}", text.empty() ? "" : ", ", one.name, number(*one.standard_error, 2), known->unit);
  }
  return text;
}

}  // namespace llmt::report
