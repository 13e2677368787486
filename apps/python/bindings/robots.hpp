/// \file
/// Robots and tables as Python hands them over.
#pragma once

#include <nanobind/nanobind.h>

#include <optional>
#include <string>
#include <utility>

#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::python {

namespace nb = nanobind;

/// A robot with what it came from.
struct Arm {
  std::string name;  ///< of the file, for messages
  robotics::CorrectedRobot robot;
  std::string urdf = {};  ///< the text that the arm was read from; empty: no URDF
};

/// The name of a table, and its text; without a text the name is a path.
using Source = std::pair<std::string, std::optional<std::string>>;

/// How tables are read.
struct Reading {
  std::optional<Source> columns;  ///< column map
  bool orientations = false;
  bool decimal_comma = false;

  DecimalMark mark() const { return decimal_comma ? DecimalMark::comma : DecimalMark::point; }
  robotics::ColumnMap map() const;
};

/// Throws as robotics::read_measurements() and robotics::with_orientations(), with the table's name.
robotics::Measurements measurements_of(const Source& source, const robotics::Robot& robot,
                                       const std::vector<std::string>& also, const Reading& reading);
robotics::PoseTable poses_of(const Source& source, const robotics::Robot& robot, const Reading& reading);
robotics::TargetTable targets_of(const Source& source, const robotics::Robot& robot, const Reading& reading);

}  // namespace llmt::python
