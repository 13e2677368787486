/// \file
/// The options that say how a file of measurements is to be read.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "llmt/robotics/measurements.hpp"

namespace llmt::apps {

struct MeasuredFileOptions {
  std::string columns;        ///< column map, or empty
  bool orientations = false;  ///< to be fitted, too
  DecimalMark mark = DecimalMark::point;
};

/// --columns.
void add_column_map(CLI::App& command, std::string& path);

/// The map in a file; an empty one without a file. Throws as robotics::read_column_map().
robotics::ColumnMap column_map(const std::string& path);

/// --columns, --orientations and --decimal-comma.
void add_measured_file_options(CLI::App& command, MeasuredFileOptions& options);

/// Throws as robotics::read_measurements() and robotics::with_orientations(), with the file's name.
robotics::Measurements read_measured(const std::string& path, const robotics::Robot& robot,
                                     const std::vector<std::string>& also, const MeasuredFileOptions& options);

}  // namespace llmt::apps
