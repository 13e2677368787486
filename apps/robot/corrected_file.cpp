#include "robot/corrected_file.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "shared/options.hpp"

namespace llmt::apps {

std::vector<std::string> save_corrected(robotics::CorrectedRobot robot, const std::string& path,
                                        const DescriptionSource& source) {
  std::vector<NewFile> files;
  std::vector<std::string> names;
  robot.robot.correction_file.clear();
  if (robot.correction) {
    const std::filesystem::path correction = beside(path, correction_extension);
    robot.robot.correction_file = correction.filename().string();
    names.push_back(correction.string());
    files.push_back({names.back(), to_json(*robot.correction)});
  }
  const bool urdf = robotics::is_urdf(path);
  names.push_back(urdf ? beside(path, ".yaml").string() : path);
  files.push_back({names.back(), robotics::to_yaml(robot.robot)});
  if (urdf) {
    names.push_back(path);
    files.push_back({path, robotics::to_urdf(read_file(source.path), source.path, source.links, robot.robot.chain)});
  }
  write_files(files);
  return names;
}

std::string beside_urdf(const std::string& path) {
  return fmt::format(
      "The URDF has the identified origins of the joints. It cannot hold the instrument's frame, the tool point, "
      "effects "
      "and the correction: {} has these, and the arm, for llmt-robot.\n",
      beside(path, ".yaml").string());
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
