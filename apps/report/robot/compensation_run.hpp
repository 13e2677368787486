/// \file
/// Joint commands for targets, from what was read to tables and text.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "llmt/robotics/compensation.hpp"
#include "report/robot/input_checks.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

/// What is asked of a compensation. The names of files stand in messages.
struct CompensationTask {
  std::string robot_file;
  std::string targets_file;
  std::string nominal_file;
  /// Reads the chain that the controller goes by, for targets that are joint values; may be empty.
  std::function<robotics::Chain()> read_nominal = {};
  bool in_base_frame = false;   ///< poses of targets are in the frame of the robot's base, not of the instrument
  bool nominal_frames = false;  ///< base and tool are those of the nominal chain
  bool position_only = false;   ///< orientations do not count
  double tolerance_mm = 1e-6;
  Progress progress = {};
};

struct CompensationRun {
  CompensationTask task;
  robotics::CorrectedRobot robot;  ///< the arm alone
  robotics::TargetTable table;
  robotics::Targets targets;
  robotics::Compensation found;
};

/// Finds the commands. `given`: see arm_alone(). Rows that are not as asked for, what was made up and what is not used
/// are named by `warn`. Throws as robotics::compensate(), and with the names of the files.
CompensationRun run_compensation(const robotics::CorrectedRobot& given, robotics::TargetTable table,
                                 CompensationTask task, const Warn& warn);

/// The commands under the names and in the units of the targets, with what became of each.
std::string commands_csv(const CompensationRun& run);

/// `output`: file of the commands, or empty.
Json compensation_json(const CompensationRun& run, const std::string& output);

/// For people, without a line break at its end.
std::string compensation_text(const CompensationRun& run, const std::string& output);

/// Why not all targets are met; nothing if they can be reached.
std::optional<Finding> compensation_refusal(const CompensationRun& run);

}  // namespace llmt::report
