#include "report/robot/compensation_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>
#include <vector>

#include "llmt/robotics/kinematics.hpp"
#include "llmt/robotics/orientation.hpp"
#include "llmt/robotics/rigid_arm.hpp"
#include "llmt/robotics/simulation.hpp"

namespace llmt::report {
namespace {

using robotics::Compensation;
using robotics::CorrectedRobot;
using robotics::Outcome;

// The robot as it stands in the session and with the target that the table names.
CorrectedRobot in_frames(CorrectedRobot robot, const robotics::Observation& frames) {
  std::string target = frames.tool;  // see robotics::in_session()
  if (!frames.base.empty()) target = frames.tool.substr(std::min(frames.tool.size(), frames.base.size() + 1));
  robot.robot.chain = robotics::in_session(std::move(robot.robot.chain), frames.base, target);
  return robot;
}

// What the nominal description says of the asked-for joints, as the robot stands and with the tool that it carries.
void take_nominal_poses(const CompensationTask& task, const CorrectedRobot& robot, robotics::Targets& targets) {
  if (!task.read_nominal) {
    throw std::invalid_argument(
        fmt::format("{}: there are joints and no positions; --nominal ROBOT says where they are to bring the tool",
                    task.targets_file));
  }
  robotics::Chain nominal = task.read_nominal();
  if (nominal.joints.size() != robot.robot.chain.joints.size()) {
    throw std::invalid_argument(fmt::format("--nominal: {} has {} joints, {} has {}", task.nominal_file,
                                            nominal.joints.size(), task.robot_file, robot.robot.chain.joints.size()));
  }
  if (!task.nominal_frames) nominal = robotics::with_fitted_frames(std::move(nominal), robot);
  const robotics::Kinematics kinematics(nominal);
  targets.positions_mm.resize(targets.start.count(), 3);
  for (Eigen::Index row = 0; row < targets.start.count(); ++row) {
    const robotics::Pose pose = kinematics.forward(targets.start.joints.row(row).transpose());
    targets.positions_mm.row(row) = pose.position_mm.transpose();
    targets.rotations.push_back(pose.rotation);
  }
}

void to_world(const robotics::Chain& chain, robotics::Targets& targets) {
  robotics::Chain base = chain;
  base.tool = {};
  const Eigen::VectorXd any = Eigen::VectorXd::Zero(std::ssize(chain.joints));
  const Eigen::Matrix3d rotation = robotics::Kinematics(base).skeleton(any).base_rotation;
  targets.positions_mm = (targets.positions_mm * rotation.transpose()).rowwise() + chain.base.xyz_mm.transpose();
  for (Eigen::Matrix3d& of_tool : targets.rotations) of_tool = rotation * of_tool;
}

robotics::Targets asked(const CompensationTask& task, const CorrectedRobot& robot, const robotics::TargetTable& table,
                        const Warn& warn, const Progress& progress) {
  robotics::Targets targets;
  targets.start.joints = table.joints;
  targets.start.covariates = table.covariates;
  targets.positions_mm = table.positions_mm;
  try {
    targets.rotations = robotics::rotations_of(table.orientation, table.orientation.convention);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(task.targets_file + ": " + error.what());
  }
  if (table.positions_mm.size() == 0) {
    targets.rotations.clear();
    take_nominal_poses(task, robot, targets);
  } else if (task.in_base_frame) {
    to_world(robot.robot.chain, targets);
  }
  if (table.positions_mm.size() > 0 && task.read_nominal) {
    warn({"nominal_not_read", [=](const Face& face) {
            return fmt::format("{}: the targets are poses: {} is not read", face.table(task.targets_file),
                               task.nominal_file);
          }});
  }
  if (task.position_only) targets.rotations.clear();
  if (table.joints.size() == 0) targets.start.joints = robotics::rigid_joints(robot.robot, targets, progress);
  return targets;
}

// Each row that is not what was asked for, but not thousands of them.
void name_rows(const CompensationRun& run, const Warn& warn) {
  const Compensation& found = run.found;
  constexpr int most = 20;
  int said = 0;
  const auto say = [&](std::size_t row, const std::string& code, const std::string& what) {
    const Eigen::Index line = run.table.lines[row];
    if (said++ >= most) return;
    warn({code,
          [=, file = run.task.targets_file](const Face& face) {
            return fmt::format("{}: {}", face.place(file, line), what);
          },
          {line}});
  };
  for (std::size_t row = 0; row < found.outcomes.size(); ++row) {
    if (found.outcomes[row] != Outcome::reached) {
      const std::string outcome = robotics::to_string(found.outcomes[row]);
      say(row, outcome, fmt::format("{}: {}; {:.4g} mm away", outcome, found.reasons[row], found.after_mm(row)));
    }
    if (!found.uncovered[row].empty()) say(row, "not_covered", "not covered: " + found.uncovered[row]);
  }
  if (said > most) {
    warn({"more_rows", [file = run.task.targets_file, more = said - most](const Face& face) {
            return fmt::format("{}: {} more rows; the columns outcome and covered have them", face.table(file), more);
          }});
  }
}

// Nobody positions an arm to a nanometre.
std::string distance_text(double mm) { return mm < 1e-6 ? "less than 0.001 um" : fmt::format("{:.4g} mm", mm); }

// Over the targets that were reached: one that is far off would say nothing of the others.
std::string mean_distances(const robotics::TargetTable& table, const Compensation& found) {
  double before = 0.0;
  double after = 0.0;
  double count = 0.0;
  for (std::size_t row = 0; row < found.outcomes.size(); ++row) {
    if (found.outcomes[row] == Outcome::limit || found.outcomes[row] == Outcome::unreachable) continue;
    before += found.before_mm(static_cast<Eigen::Index>(row));
    after += found.after_mm(static_cast<Eigen::Index>(row));
    count += 1.0;
  }
  if (count == 0.0) return "";
  const std::string start =
      table.joints.size() == 0 ? "" : fmt::format("{} with the start joints, ", distance_text(before / count));
  return fmt::format("\nMean distance from the targets within reach, by the model of the arm: {}{} with the commands.",
                     start, distance_text(after / count));
}

// Joint values that no arm has: most often degrees in a column of radians.
void warn_of_units(const std::string& file, const robotics::Chain& chain, const robotics::TargetTable& table,
                   const Warn& warn) {
  if (table.joints.size() == 0) return;
  std::vector<std::string> outside;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const robotics::Joint& joint = chain.joints[j];
    const bool turns = joint.type == robotics::JointType::revolute;
    if (!turns && !joint.limits) continue;
    constexpr double two_turns = 720.0;
    constexpr double slack = 1.0;  // degree or mm
    const std::array<double, 2> limits = joint.limits.value_or(std::array{-two_turns, two_turns});
    const Eigen::ArrayXd values = table.joints.col(j) * robotics::to_limit_unit(joint);
    const Eigen::Index count = (values < limits[0] - slack || values > limits[1] + slack).count();
    if (count > 0) {
      outside.push_back(fmt::format("{} in {} of {} rows (up to {:.4g} {})", joint.name, count, values.size(),
                                    values.abs().maxCoeff(), robotics::limit_unit(joint)));
    }
  }
  if (outside.empty()) return;
  const std::string said = fmt::format(
      "joint values outside of the joints' limits: {}; are the units in the column names right (_rad, _deg)?",
      fmt::join(outside, ", "));
  warn({.code = "joint_limits",
        .words = [=](const Face& face) { return fmt::format("{}: {}", face.table(file), said); },
        .is_mistake = true});
}

}  // namespace

CompensationRun run_compensation(const CorrectedRobot& given, robotics::TargetTable table, CompensationTask task,
                                 const Warn& warn) {
  const CorrectedRobot robot = in_frames(given, table.frames);
  CompensationRun run{std::move(task), robot, std::move(table), {}, {}};
  warn_of_units(run.task.targets_file, robot.robot.chain, run.table, warn);
  Work work(run.task.progress);
  Work starting(work, run.table.joints.size() == 0 ? 0.5 : 0.0);
  run.targets = asked(run.task, robot, run.table, warn, starting.progress());
  const robotics::Poses& start = run.targets.start;
  check_positions(run.task.robot_file, robot.robot,
                  robotics::with_needed_columns(robot.robot, robotics::with_approach(robot.robot, start), 1));
  work.check();
  Work solving(work, work.left());
  run.found =
      robotics::compensate(robot, run.targets, {.tolerance_mm = run.task.tolerance_mm, .progress = solving.progress()});
  name_made_up(start, run.found.commands, warn);
  name_uncovered(robot.robot, run.found.commands, warn);
  name_rows(run, warn);
  const std::vector<std::string>& unused = run.table.unused_columns;
  if (!unused.empty()) {
    warn(finding("columns_not_used", fmt::format("Columns not used: {}", fmt::join(unused, ", "))));
  }
  if (!run.targets.rotations.empty() && robotics::drive_count(robot.robot.chain) < 6) {
    warn(finding("few_drives",
                 fmt::format("{} has fewer than six drives: orientations are not kept", robot.robot.chain.name)));
  }
  work.finish();
  return run;
}

std::string commands_csv(const CompensationRun& run) {
  const CorrectedRobot& robot = run.robot;
  const robotics::TargetTable& table = run.table;
  const Compensation& found = run.found;
  const std::vector<robotics::JointColumn> by_name = robotics::joint_columns(robot.robot.chain);
  std::vector<std::string> names;
  std::vector<Eigen::VectorXd> columns;
  for (std::size_t j = 0; j < robot.robot.chain.joints.size(); ++j) {
    const robotics::Joint& joint = robot.robot.chain.joints[j];
    if (joint.mimic) continue;  // it has no drive
    robotics::JointColumn column = by_name[j];
    if (!table.joint_columns.empty() && !table.joint_columns[j].name.empty()) column = table.joint_columns[j];
    names.push_back(robotics::csv_field(column.name));
    columns.push_back(robotics::in_unit_of(column, found.commands.joints.col(j)));
  }
  for (const auto& [name, values] : found.commands.covariates) {
    if (robotics::is_move(name)) continue;
    names.push_back(name);
    columns.push_back(values);
  }
  names.emplace_back("error_mm");
  columns.push_back(found.after_mm);
  if (found.after_deg.size() > 0) {
    names.emplace_back("error_deg");
    columns.push_back(found.after_deg);
  }
  std::string text = fmt::format("{},outcome,covered\n", fmt::join(names, ","));
  for (std::size_t row = 0; row < found.outcomes.size(); ++row) {
    for (const Eigen::VectorXd& column : columns) text += fmt::format("{},", column(row));
    text += fmt::format("{},{}\n", robotics::to_string(found.outcomes[row]), found.uncovered[row].empty() ? 1 : 0);
  }
  return text;
}

Json compensation_json(const CompensationRun& run, const std::string& output) {
  const Compensation& found = run.found;
  Json json = {{"robot", run.task.robot_file}, {"targets", found.outcomes.size()}};
  for (const Outcome outcome :
       {Outcome::reached, Outcome::jump, Outcome::limit, Outcome::unreachable, Outcome::branch, Outcome::singular}) {
    json["outcomes"][robotics::to_string(outcome)] = std::ranges::count(found.outcomes, outcome);
  }
  json["uncovered"] = std::ranges::count_if(found.uncovered, [](const std::string& text) { return !text.empty(); });
  json["frame"] = frames_text(run.robot.robot.chain);
  json["mean_before_mm"] = found.before_mm.mean();
  json["mean_after_mm"] = found.after_mm.mean();
  json["max_after_mm"] = found.after_mm.maxCoeff();
  json["output"] = output.empty() ? Json(nullptr) : Json(output);
  return json;
}

std::string compensation_text(const CompensationRun& run, const std::string& output) {
  const Compensation& found = run.found;
  const auto of = [&](Outcome outcome) { return std::ranges::count(found.outcomes, outcome); };
  const auto uncovered = std::ranges::count_if(found.uncovered, [](const std::string& text) { return !text.empty(); });
  return fmt::format(
      "{}: {} targets, {} reached; {} at jumps of the model, {} at limits, {} unreachable, {} on another branch, {} "
      "near singular poses{}.\nTargets are {}.{}{}",
      run.robot.robot.chain.name, found.outcomes.size(), of(Outcome::reached), of(Outcome::jump), of(Outcome::limit),
      of(Outcome::unreachable), of(Outcome::branch), of(Outcome::singular),
      uncovered > 0 ? fmt::format("; {} outside of the joint values that the correction was trained on", uncovered)
                    : "",
      frames_text(run.robot.robot.chain), mean_distances(run.table, found),
      output.empty() ? "" : "\nWritten to " + output);
}

std::optional<Finding> compensation_refusal(const CompensationRun& run) {
  const auto missed = std::ranges::count_if(
      run.found.outcomes, [](Outcome outcome) { return outcome == Outcome::limit || outcome == Outcome::unreachable; });
  if (missed == 0) return {};
  return Finding{"out_of_reach", [=, file = run.task.targets_file](const Face& face) {
                   return fmt::format("{}: {} target{} cannot be reached", face.table(file), missed,
                                      missed == 1 ? "" : "s");
                 }};
}

}  // namespace llmt::report
