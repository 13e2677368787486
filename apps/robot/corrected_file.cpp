#include "robot/corrected_file.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/rigid_arm.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "shared/options.hpp"

namespace llmt::apps {

namespace {

std::string beside_urdf(const std::string& path, bool has_tool) {
  const std::string yaml = beside(path, ".yaml").string();
  if (has_tool) {
    return fmt::format(
        "The URDF has the identified origins of the joints, and its tip is the identified tool. It cannot hold the "
        "instrument's frame, effects and the correction: {} has these, and the arm, for llmt-robot.\n",
        yaml);
  }
  return fmt::format(
      "The URDF has the identified origins of the joints. Its tip is where it was: no fixed joint holds it, or further "
      "links hang on it. The identified tool, the instrument's frame, effects and the correction are in {}, which has "
      "the arm, too, for llmt-robot.\n",
      yaml);
}

}  // namespace

SavedRobot save_corrected(robotics::CorrectedRobot robot, const std::string& path, const DescriptionSource& source) {
  std::vector<NewFile> files;
  SavedRobot saved;
  std::vector<std::string>& names = saved.names;
  robot.robot.correction_file.clear();
  if (robot.correction) {
    const std::filesystem::path correction = beside(path, correction_extension);
    robot.robot.correction_file = correction.filename().string();
    names.push_back(correction.string());
    files.push_back({names.back(), robotics::to_json(*robot.correction)});
  }
  const bool urdf = robotics::is_urdf(path);
  names.push_back(urdf ? beside(path, ".yaml").string() : path);
  files.push_back({names.back(), robotics::to_yaml(robot.robot)});
  if (urdf) {
    names.push_back(path);
    const robotics::IdentifiedUrdf identified =
        robotics::to_urdf(read_file(source.path), source.path, source.links, robotics::geometry_alone(robot).chain);
    files.push_back({path, identified.text});
    saved.beside_urdf = beside_urdf(path, identified.has_tool);
  }
  write_files(files);
  return saved;
}

void check_beside_urdf(const CLI::App& command, const std::string& output) {
  if (robotics::is_urdf(output)) check_output_file(command, "--output", output, {".yaml"});
}

void refuse_lost_correction(const robotics::Robot& robot, const std::string& input, const std::string& output) {
  if (robotics::is_urdf(output) && !robotics::is_urdf(input)) {
    throw std::invalid_argument(
        fmt::format("--output: {} is a URDF, which is made from a URDF; {} is none", output, input));
  }
  if (robot.correction_file.empty() || output.empty()) return;
  const std::string correction = (std::filesystem::path(input).parent_path() / robot.correction_file).string();
  refuse_lost_input(output, correction);
  refuse_lost_input(beside(output, correction_extension).string(), correction);
}

}  // namespace llmt::apps
