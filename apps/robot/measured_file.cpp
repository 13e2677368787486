#include "robot/measured_file.hpp"

#include <fmt/format.h>

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

}  // namespace llmt::apps
