/// \file
/// A robot description on its way to a file, with its correction beside it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "llmt/robotics/correction.hpp"

namespace llmt::apps {

/// FILE.correction.json stands beside FILE.yaml.
inline constexpr const char* correction_extension = ".correction.json";

/// Where a description came from.
struct DescriptionSource {
  std::string path;
  robotics::UrdfLinks links;
};

/// What was written.
struct SavedRobot {
  std::vector<std::string> names;  ///< of the files
  std::string beside_urdf;         ///< what a written URDF does not hold and where that is, in sentences
};

/// Writes the description and, if there is one, the correction. If `path` is a URDF, that gets the origins of the
/// joints and, where the tip hangs on a fixed joint, the tool; the description, which has everything, stands beside it
/// as YAML. All files are replaced or none.
SavedRobot save_corrected(robotics::CorrectedRobot robot, const std::string& path, const DescriptionSource& source);

/// The checks of check_output_file() for the YAML that stands beside `output` if that is a URDF.
void check_beside_urdf(const CLI::App& command, const std::string& output);

/// Refuses to lose the correction that the description at `input` names: throws std::invalid_argument if it is `output`
/// or the correction beside that; or if `output` is a URDF and `input` is none.
void refuse_lost_correction(const robotics::Robot& robot, const std::string& input, const std::string& output);

}  // namespace llmt::apps
