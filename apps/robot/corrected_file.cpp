#include "robot/corrected_file.hpp"

#include <filesystem>

#include "llmt/files.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "shared/options.hpp"

namespace llmt::apps {

std::vector<std::string> save_corrected(robotics::CorrectedRobot robot, const std::string& path) {
  std::vector<NewFile> files;
  std::vector<std::string> names;
  robot.robot.correction_file.clear();
  if (robot.correction) {
    const std::filesystem::path correction = beside(path, correction_extension);
    robot.robot.correction_file = correction.filename().string();
    names.push_back(correction.string());
    files.push_back({names.back(), to_json(*robot.correction)});
  }
  names.push_back(path);
  files.push_back({path, robotics::to_yaml(robot.robot)});
  write_files(files);
  return names;
}

void refuse_lost_correction(const robotics::Robot& robot, const std::string& input, const std::string& output) {
  if (robot.correction_file.empty() || output.empty()) return;
  const std::string correction = (std::filesystem::path(input).parent_path() / robot.correction_file).string();
  refuse_lost_input(output, correction);
  refuse_lost_input(beside(output, correction_extension).string(), correction);
}

}  // namespace llmt::apps
