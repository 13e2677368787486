#include "python/bindings/robots.hpp"

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <yaml-cpp/yaml.h>

#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/module.hpp"
#include "report/text/json.hpp"

namespace llmt::python {
namespace {

using report::Json;

// What to_yaml() wrote: plain scalars are numbers where they can be, quoted ones and the others are words.
Json json_of(const YAML::Node& node) {
  if (node.IsMap()) {
    Json map = Json::object();
    for (const auto& entry : node) map[entry.first.Scalar()] = json_of(entry.second);
    return map;
  }
  if (node.IsSequence()) {
    Json list = Json::array();
    for (const YAML::Node& value : node) list.push_back(json_of(value));
    return list;
  }
  if (node.IsNull()) return nullptr;
  const std::string text = node.Scalar();
  if (node.Tag() == "!") return text;
  if (const Json number = Json::parse(text, nullptr, false); number.is_number()) return number;
  return text;
}

// A description in memory stands in no folder in which its correction could be.
robotics::CorrectedRobot with_correction(robotics::Robot robot, const std::string& name,
                                         const std::optional<std::string>& correction) {
  if (!robot.correction_file.empty() && !correction) {
    throw std::runtime_error(fmt::format("{}: correction: the text names the file {}; read the description by its path",
                                         name, robot.correction_file));
  }
  robot.correction_file.clear();
  robotics::CorrectedRobot corrected{std::move(robot), {}};
  if (correction) corrected.correction = robotics::correction_from_json(*correction);
  return corrected;
}

Arm read_arm(const std::string& path, const std::string& base, const std::string& tip) {
  Arm arm{path, robotics::read_corrected_robot(path, {.base = base, .tip = tip})};
  if (robotics::is_urdf(path)) arm.urdf = read_file(path);
  return arm;
}

Arm parse_yaml(const std::string& text, const std::string& name, const std::optional<std::string>& correction,
               const std::string& urdf) {
  return {name, with_correction(robotics::parse_robot(text, name), name, correction), urdf};
}

Arm parse_urdf(const std::string& text, const std::string& name, const std::string& base, const std::string& tip) {
  robotics::Robot robot;
  robot.urdf_links = {.base = base, .tip = tip};
  robot.chain = robotics::parse_urdf(text, name, robot.urdf_links);
  return {name, {std::move(robot), {}}, text};
}

std::string yaml_of(const Arm& arm) {
  robotics::Robot robot = arm.robot.robot;
  robot.correction_file.clear();
  return robotics::to_yaml(robot);
}

std::string urdf_of(const Arm& arm) {
  if (arm.urdf.empty()) {
    throw std::runtime_error(
        fmt::format("{}: a URDF is made from a URDF, and this robot was read from none", arm.name));
  }
  const robotics::Robot& robot = arm.robot.robot;
  return robotics::to_urdf(arm.urdf, arm.name, robot.urdf_links, robot.chain).text;
}

std::optional<std::string> correction_of(const Arm& arm) {
  return arm.robot.correction ? std::optional(robotics::to_json(*arm.robot.correction)) : std::nullopt;
}

// As `llmt-robot calibrate -o`: `correction` and `yaml` stand beside `path` where they are needed.
std::vector<std::string> save(const Arm& arm, const std::string& path, const std::string& yaml,
                              const std::string& correction) {
  std::vector<NewFile> files;
  robotics::Robot robot = arm.robot.robot;
  robot.correction_file.clear();
  if (arm.robot.correction) {
    files.push_back({correction, robotics::to_json(*arm.robot.correction)});
    robot.correction_file = correction.substr(correction.find_last_of('/') + 1);
  }
  files.push_back({yaml, robotics::to_yaml(robot)});
  if (yaml != path) files.push_back({path, urdf_of(arm)});
  write_or_raise(files);
  std::vector<std::string> names;
  for (const NewFile& file : files) names.push_back(file.path);
  return names;
}

nb::list joints_of(const Arm& arm) {
  nb::list joints;
  for (const robotics::Joint& joint : arm.robot.robot.chain.joints) {
    nb::dict entry;
    entry["name"] = joint.name;
    entry["type"] = joint.type == robotics::JointType::revolute ? "revolute" : "prismatic";
    entry["unit"] = robotics::limit_unit(joint);
    entry["limits"] = nb::none();
    if (joint.limits) entry["limits"] = nb::make_tuple((*joint.limits)[0], (*joint.limits)[1]);
    entry["driven"] = !joint.mimic.has_value();
    joints.append(entry);
  }
  return joints;
}

// A table in memory has decimal points whatever the files of the map have.
robotics::ColumnMap in_memory(robotics::ColumnMap map) {
  map.decimal.reset();
  return map;
}

template <class Read, class Parse>
auto read_or_parse(const Source& source, const Read& read, const Parse& parse) {
  return source.second ? parse(*source.second) : read();
}

}  // namespace

robotics::ColumnMap Reading::map() const {
  if (!columns) return {};
  return read_or_parse(
      *columns, [&] { return robotics::read_column_map(columns->first); },
      [&](const std::string& text) { return robotics::parse_column_map(text, columns->first); });
}

robotics::Measurements measurements_of(const Source& source, const robotics::Robot& robot,
                                       const std::vector<std::string>& also, const Reading& reading) {
  const robotics::ColumnMap map = reading.map();
  robotics::Measurements measurements = read_or_parse(
      source, [&] { return robotics::read_measurements(source.first, robot, also, reading.mark(), map); },
      [&](const std::string& text) {
        return robotics::parse_measurements(text, source.first, robot, also, DecimalMark::point, in_memory(map));
      });
  if (!reading.orientations) return measurements;
  try {
    return robotics::with_orientations(measurements, robot.chain);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: --orientations: {}", source.first, error.what()));
  }
}

robotics::PoseTable poses_of(const Source& source, const robotics::Robot& robot, const Reading& reading) {
  const robotics::ColumnMap map = reading.map();
  return read_or_parse(
      source, [&] { return robotics::read_pose_table(source.first, robot, reading.mark(), map); },
      [&](const std::string& text) {
        return robotics::parse_pose_table(text, source.first, robot, DecimalMark::point, in_memory(map));
      });
}

robotics::TargetTable targets_of(const Source& source, const robotics::Robot& robot, const Reading& reading) {
  const robotics::ColumnMap map = reading.map();
  return read_or_parse(
      source, [&] { return robotics::read_targets(source.first, robot, reading.mark(), map); },
      [&](const std::string& text) {
        return robotics::parse_targets(text, source.first, robot, DecimalMark::point, in_memory(map));
      });
}

void add_robots(nb::module_& module) {
  nb::class_<Arm>(module, "Robot", "A robot with its correction, and the URDF that it was read from.")
      .def_static("read", &read_arm, nb::arg("path"), nb::arg("base"), nb::arg("tip"))
      .def_static("parse_yaml", &parse_yaml, nb::arg("text"), nb::arg("name"), nb::arg("correction") = nb::none(),
                  nb::arg("urdf") = "")
      .def_static("parse_urdf", &parse_urdf, nb::arg("text"), nb::arg("name"), nb::arg("base"), nb::arg("tip"))
      .def_ro("name", &Arm::name)
      .def_ro("urdf", &Arm::urdf)
      .def("title", [](const Arm& self) { return self.robot.robot.chain.name; })
      .def("yaml", &yaml_of)
      .def("json", [](const Arm& self) { return json_of(YAML::Load(yaml_of(self))).dump(); })
      .def("correction", &correction_of)
      .def("to_urdf", &urdf_of)
      .def("save", &save, nb::arg("path"), nb::arg("yaml"), nb::arg("correction"))
      .def("joints", &joints_of);
  nb::class_<Reading>(module, "Reading", "How tables are read.")
      .def(nb::init<std::optional<Source>, bool, bool>(), nb::arg("columns").none(), nb::arg("orientations"),
           nb::arg("decimal_comma"));
}

}  // namespace llmt::python
