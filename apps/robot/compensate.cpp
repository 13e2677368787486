#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/compensation.hpp"
#include "llmt/robotics/orientation.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robot/commands.hpp"
#include "robot/measured_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

using robotics::Compensation;
using robotics::CorrectedRobot;
using robotics::Outcome;

struct CompensateArguments {
  std::string robot;
  robotics::UrdfLinks links;
  std::string targets;
  std::string nominal;
  std::string output;
  std::string frame = "world";
  bool nominal_frames = false;
  bool position_only = false;
  bool json = false;
  double tolerance_um = 0.001;
  std::string columns;
  DecimalMark mark = DecimalMark::point;
};

// What the nominal description says of the asked-for joints, as the robot stands and with the tool that it carries.
void take_nominal_poses(const CompensateArguments& arguments, const CorrectedRobot& robot, robotics::Targets& targets) {
  if (arguments.nominal.empty()) {
    throw std::invalid_argument(
        fmt::format("{}: there are joints and no positions; --nominal ROBOT says where they are to bring the tool",
                    arguments.targets));
  }
  robotics::Chain nominal =
      robotics::read_robot(arguments.nominal, links_for(arguments.nominal, arguments.links, robot.robot)).chain;
  if (nominal.joints.size() != robot.robot.chain.joints.size()) {
    throw std::invalid_argument(fmt::format("--nominal: {} has {} joints, {} has {}", arguments.nominal,
                                            nominal.joints.size(), arguments.robot, robot.robot.chain.joints.size()));
  }
  if (!arguments.nominal_frames) {
    nominal.base = robot.robot.chain.base;
    nominal.tool = robot.robot.chain.tool;
  }
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

robotics::Targets asked(const CompensateArguments& arguments, const CorrectedRobot& robot,
                        const robotics::TargetTable& table) {
  robotics::Targets targets;
  targets.start.joints = table.joints;
  targets.start.covariates = table.covariates;
  targets.positions_mm = table.positions_mm;
  try {
    targets.rotations = robotics::rotations_of(table.orientation, table.orientation.convention);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(arguments.targets + ": " + error.what());
  }
  if (table.positions_mm.size() == 0) {
    targets.rotations.clear();
    take_nominal_poses(arguments, robot, targets);
  } else if (arguments.frame == "base") {
    to_world(robot.robot.chain, targets);
  }
  if (table.positions_mm.size() > 0 && !arguments.nominal.empty()) {
    warn(fmt::format("{}: the targets are poses: {} is not read", arguments.targets, arguments.nominal));
  }
  if (arguments.position_only) targets.rotations.clear();
  if (table.joints.size() == 0) targets.start.joints = robotics::rigid_joints(robot.robot, targets);
  return targets;
}

std::string commands_csv(const CorrectedRobot& robot, const robotics::TargetTable& table, const Compensation& found) {
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

// Each row that is not what was asked for, but not thousands of them.
void name_rows(const CompensateArguments& arguments, const robotics::TargetTable& table, const Compensation& found) {
  constexpr int most = 20;
  int said = 0;
  const auto say = [&](std::size_t row, const std::string& what) {
    if (said++ < most) warn(fmt::format("{}:{}: {}", arguments.targets, table.lines[row], what));
  };
  for (std::size_t row = 0; row < found.outcomes.size(); ++row) {
    if (found.outcomes[row] != Outcome::reached) {
      say(row, fmt::format("{}: {}; {:.4g} mm away", robotics::to_string(found.outcomes[row]), found.reasons[row],
                           found.after_mm(row)));
    }
    if (!found.uncovered[row].empty()) say(row, "not covered: " + found.uncovered[row]);
  }
  if (said > most)
    warn(fmt::format("{}: {} more rows; the columns outcome and covered have them", arguments.targets, said - most));
}

Json summary_json(const CompensateArguments& arguments, const Compensation& found) {
  Json json = {{"robot", arguments.robot}, {"targets", found.outcomes.size()}};
  for (const Outcome outcome :
       {Outcome::reached, Outcome::jump, Outcome::limit, Outcome::unreachable, Outcome::branch, Outcome::singular}) {
    json["outcomes"][robotics::to_string(outcome)] = std::ranges::count(found.outcomes, outcome);
  }
  json["uncovered"] = std::ranges::count_if(found.uncovered, [](const std::string& text) { return !text.empty(); });
  json["mean_before_mm"] = found.before_mm.mean();
  json["mean_after_mm"] = found.after_mm.mean();
  json["max_after_mm"] = found.after_mm.maxCoeff();
  json["output"] = arguments.output.empty() ? Json(nullptr) : Json(arguments.output);
  return json;
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

std::string summary(const CorrectedRobot& robot, const robotics::TargetTable& table, const Compensation& found,
                    const std::string& output) {
  const auto of = [&](Outcome outcome) { return std::ranges::count(found.outcomes, outcome); };
  const auto uncovered = std::ranges::count_if(found.uncovered, [](const std::string& text) { return !text.empty(); });
  return fmt::format(
      "{}: {} targets, {} reached; {} at jumps of the model, {} at limits, {} unreachable, {} on another branch, {} "
      "near singular poses{}.{}{}",
      robot.robot.chain.name, found.outcomes.size(), of(Outcome::reached), of(Outcome::jump), of(Outcome::limit),
      of(Outcome::unreachable), of(Outcome::branch), of(Outcome::singular),
      uncovered > 0 ? fmt::format("; {} outside of the joint values that the correction was trained on", uncovered)
                    : "",
      mean_distances(table, found), output.empty() ? "" : "\nWritten to " + output);
}

// Joint values that no arm has: most often degrees in a column of radians.
void warn_of_units(const CompensateArguments& arguments, const robotics::Chain& chain,
                   const robotics::TargetTable& table) {
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
  warn(
      fmt::format("WARNING: {}: joint values outside of the joints' limits: {}; are the units in the column names "
                  "right (_rad, _deg)?",
                  arguments.targets, fmt::join(outside, ", ")));
}

void compensate_command(const CompensateArguments& arguments) {
  const CorrectedRobot robot = read_arm(arguments.robot, links_for(arguments.robot, arguments.links, {}));
  const robotics::ColumnMap map = column_map(arguments.columns);
  const DecimalMark mark = map.decimal.value_or(arguments.mark);
  const robotics::TargetTable table = robotics::read_targets(arguments.targets, robot.robot, mark, map);
  warn_of_units(arguments, robot.robot.chain, table);
  const robotics::Targets targets = asked(arguments, robot, table);
  check_positions(arguments.robot, robot.robot,
                  robotics::with_needed_columns(robot.robot, robotics::with_approach(robot.robot, targets.start), 1));
  const Compensation found = robotics::compensate(robot, targets, {.tolerance_mm = 1e-3 * arguments.tolerance_um});
  const std::string csv = with_decimal_mark(commands_csv(robot, table, found), mark);
  name_made_up(targets.start, found.commands);
  name_rows(arguments, table, found);
  if (!table.unused_columns.empty()) warn(fmt::format("Columns not used: {}", fmt::join(table.unused_columns, ", ")));
  if (!targets.rotations.empty() && robotics::drive_count(robot.robot.chain) < 6) {
    warn(fmt::format("{} has fewer than six drives: orientations are not kept", robot.robot.chain.name));
  }
  if (!arguments.output.empty()) write_file(arguments.output, csv);
  if (arguments.json) {
    print_json(summary_json(arguments, found));
  } else if (arguments.output.empty()) {
    print_bytes(csv);
    warn(summary(robot, table, found, ""));
  } else {
    print(summary(robot, table, found, arguments.output) + "\n");
  }
  const auto missed = std::ranges::count_if(
      found.outcomes, [](Outcome outcome) { return outcome == Outcome::limit || outcome == Outcome::unreachable; });
  if (missed > 0)
    throw std::runtime_error(
        fmt::format("{}: {} target{} cannot be reached", arguments.targets, missed, missed == 1 ? "" : "s"));
}

}  // namespace

void add_compensate(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "compensate",
      "Joint commands that bring the real arm where it is asked to be\n"
      "Targets are tool poses (x_mm y_mm z_mm, with qw qx qy qz or rx_deg ry_deg rz_deg where the orientation counts), "
      "or "
      "joint values with --nominal: then the pose that the nominal arm has there. Joint values beside a pose are the "
      "start, whose branch is kept. Unreachable rows are named, their nearest commands written, and the exit code is "
      "1.");
  command->footer(
      "Example: llmt-robot compensate calibrated.yaml program.csv --nominal robotics/robots/ur10.yaml -o commands.csv");
  const auto arguments = std::make_shared<CompensateArguments>();
  add_input_file(*command, "robot", arguments->robot, "Robot description (YAML), as calibrate or discover wrote it")
      ->required();
  add_urdf_links(*command, arguments->links);
  add_input_file(*command, "targets", arguments->targets, "CSV file of targets, with the covariates of the effects")
      ->required();
  add_input_file(*command, "--nominal", arguments->nominal,
                 "Description that the controller goes by; it says where joint values are to bring the tool");
  command->add_flag("--nominal-frames", arguments->nominal_frames,
                    "Base and tool are those of --nominal (default: those of the robot, which were registered)");
  add_column_map(*command, arguments->columns);
  add_decimal_comma(*command, arguments->mark);
  command->add_option("--frame", arguments->frame, "Frame of target poses: world (of the instrument) or base")
      ->check(CLI::IsMember({"world", "base"}))
      ->capture_default_str();
  command->add_flag("--position-only", arguments->position_only,
                    "Orientations do not count: joints move as little as positions allow");
  add_number(*command, "--tolerance-um", arguments->tolerance_um, above_zero,
             "Distance at which a target counts as reached, in micrometres")
      ->capture_default_str();
  add_output_file(*command, "-o,--output", arguments->output, "CSV file of commands (default: standard output)");
  command->add_flag("--json", arguments->json, "Print a summary as JSON; with it the commands go to -o only");
  command->callback([arguments] { compensate_command(*arguments); });
}

}  // namespace llmt::apps
