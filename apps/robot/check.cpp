#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "llmt/robotics/robot_check.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/urdf.hpp"
#include "report/effect_text.hpp"
#include "robot/calibration_facts.hpp"
#include "robot/commands.hpp"
#include "robot/measured_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

using robotics::Moved;
using robotics::RobotCheck;

struct CheckArguments {
  std::string robot;
  std::string data;
  bool same_session = false;
  double accuracy_mm = 0.0;
  double level = 0.05;
  std::string columns;
  DecimalMark mark = DecimalMark::point;
  bool json = false;
};

// Of a group, the parameters by their own names: "x 0.3 +- 0.01 mm".
std::string moved_words(const robotics::Robot& robot, const Moved& moved) {
  std::vector<std::string> changes;
  for (const Moved::Change& change : moved.changes) {
    const bool is_named = moved.changes.size() > 1;
    std::string own = change.parameter.substr(change.parameter.rfind('.') + 1);
    std::ranges::replace(own, '_', ' ');
    changes.push_back(fmt::format("{}{} +- {} {}", is_named ? own + " " : "", number(change.by, 4),
                                  number(change.standard_error, 2), change.unit));
  }
  std::vector<std::string> others;
  for (const std::string& other : moved.or_else) others.push_back(parameter_words(robot, other));
  return fmt::format("  {}: {}{}\n", parameter_words(robot, moved.name), fmt::join(changes, ", "),
                     others.empty() ? "" : fmt::format("; or else {}", fmt::join(others, ", ")));
}

// Each line once; readings of several targets stand in one.
std::vector<Eigen::Index> lines_of(const robotics::Measurements& measurements, const std::vector<Eigen::Index>& rows) {
  std::vector<Eigen::Index> lines;
  for (const Eigen::Index row : rows) lines.push_back(measurements.lines[row]);
  std::ranges::sort(lines);
  lines.erase(std::ranges::unique(lines).begin(), lines.end());
  return lines;
}

std::string lines_text(const std::vector<Eigen::Index>& lines) {
  constexpr std::size_t most = 20;
  const auto shown = static_cast<std::ptrdiff_t>(std::min(most, lines.size()));
  return fmt::format("line{} {}{}", lines.size() == 1 ? "" : "s", fmt::join(lines.begin(), lines.begin() + shown, ", "),
                     lines.size() > most ? ", ..." : "");
}

void print_coverage(const robotics::Measurements& measurements, const RobotCheck& check) {
  if (!check.has_ranges) {
    print(
        "The description does not say in which joint ranges it was calibrated: poses beyond them are judged as the "
        "others are. A new calibration writes them.\n");
  }
  if (check.uncovered.empty()) return;
  const std::vector<Eigen::Index> lines = lines_of(measurements, check.uncovered);
  print(fmt::format("{} of {} readings lie beyond the calibrated joint ranges ({}):\n", check.uncovered.size(),
                    measurements.count(), lines_text(lines)));
  for (const robotics::JointBeyond& joint : check.beyond) {
    print(fmt::format("  {} from {:.4g} to {:.4g} {}, calibrated from {:.4g} to {:.4g} ({})\n", joint.joint,
                      joint.used_low, joint.used_high, joint.unit, joint.measured_low, joint.measured_high,
                      lines_text(lines_of(measurements, joint.rows))));
  }
  if (check.too_few_covered) {
    print("The others are too few to say what moved.\n");
    return;
  }
  print(fmt::format("The other {} decide what moved. {} Their mean error is {:.4f} mm (95 % {:.4f}, max {:.4f}).\n",
                    measurements.count() - std::ssize(check.uncovered),
                    check.good_where_covered ? "By them the robot is still good." : "By them it is no longer good.",
                    check.covered_error.mean, check.covered_error.p95, check.covered_error.max));
}

void print_moved(const CheckArguments& arguments, const robotics::Robot& robot, const RobotCheck& check) {
  if (check.moved.empty() && !check.too_few_covered) {
    print(fmt::format(
        "Nothing moved, of {} parameters and groups of them that were tested. Where nothing moved, {:.3g} % of such "
        "checks still name something.\n",
        check.tested, 100.0 * arguments.level));
  } else if (!check.moved.empty()) {
    print("\nMoved since the calibration:\n");
    for (const Moved& moved : check.moved) print(moved_words(robot, moved));
    if (!arguments.same_session && check.moved.front().name.starts_with("tool")) {
      print("A target that was mounted anew moves the tool; the error above does not suffer.\n");
    }
    print(fmt::format("With base and these identified anew the mean error would be {:.4f} mm.\n", check.refitted_mm));
  }
  if (check.moved_beyond.empty()) return;
  print(
      "\nOnly with the readings beyond the calibrated ranges would also be named; there the calibration may be wrong "
      "without anything having moved:\n");
  for (const Moved& moved : check.moved_beyond) print(moved_words(robot, moved));
}

void print_check(const CheckArguments& arguments, const robotics::Robot& robot,
                 const robotics::Measurements& measurements, const RobotCheck& check) {
  print(fmt::format("{}: {} poses of {}\n", arguments.data, check.errors_mm.size(), robot.chain.name));
  print(arguments.same_session ? "The same session: base and tool are those of the calibration.\n\n"
                               : "The instrument was set up anew: base and tool were fitted to these poses "
                                 "(--same-session keeps them).\n\n");
  print(fmt::format(
      "{} Mean position error {:.4f} mm (95 % {:.4f}, max {:.4f}); {} {:.4f} mm, good up to {:.4f} "
      "mm.\n",
      check.still_good ? "STILL GOOD." : "NO LONGER GOOD.", check.error.mean, check.error.p95, check.error.max,
      arguments.accuracy_mm > 0.0 ? "stated" : "at calibration", check.accuracy_mm, check.limit_mm));
  if (check.accuracy_is_of_noise) {
    print(
        "The description has no error of these coordinates on poses left out: that figure comes from the poses it was "
        "fitted to, and new poses are worse. --accuracy-mm says what is good enough.\n");
  }
  print_coverage(measurements, check);
  print_moved(arguments, robot, check);
  if (check.unexplained) {
    print(
        fmt::format("Something changed that is no parameter of this description: {:.4f} mm per coordinate are left "
                    "whatever its values, {:.4f} at calibration. llmt-robot discover looks for the cause.\n",
                    check.noise_mm, check.noise_before_mm));
  }
  if (!check.unseen.empty()) {
    std::vector<std::string> unseen;
    for (const std::string& name : check.unseen) unseen.push_back(parameter_words(robot, name));
    print(fmt::format("Not seen by these poses, or taken up by base and tool: {}\n", fmt::join(unseen, "; ")));
  }
  if (!check.has_correlations) {
    print("The description has no correlations of its parameters; small changes may go unnoticed.\n");
  }
}

Json moved_json(const std::vector<Moved>& all) {
  Json list = Json::array();
  for (const Moved& moved : all) {
    Json entry = {{"name", moved.name}, {"probability", moved.probability}, {"or_else", moved.or_else}};
    for (const Moved::Change& change : moved.changes) {
      entry["changes"].push_back({{"parameter", change.parameter},
                                  {"unit", change.unit},
                                  {"by", change.by},
                                  {"standard_error", change.standard_error}});
    }
    list.push_back(std::move(entry));
  }
  return list;
}

// null where the description does not know its ranges.
Json uncovered_json(const robotics::Measurements& measurements, const RobotCheck& check) {
  if (!check.has_ranges) return nullptr;
  Json joints = Json::array();
  for (const robotics::JointBeyond& joint : check.beyond) {
    joints.push_back({{"joint", joint.joint},
                      {"unit", joint.unit},
                      {"calibrated", {joint.measured_low, joint.measured_high}},
                      {"used", {joint.used_low, joint.used_high}},
                      {"lines", lines_of(measurements, joint.rows)}});
  }
  const bool is_judged = !check.too_few_covered;
  return {{"readings", check.uncovered.size()},
          {"lines", lines_of(measurements, check.uncovered)},
          {"joints", std::move(joints)},
          {"covered_error_mm", is_judged ? figures_json(check.covered_error) : Json(nullptr)},
          {"good_where_covered", is_judged ? Json(check.good_where_covered) : Json(nullptr)},
          {"moved_beyond", moved_json(check.moved_beyond)}};
}

Json check_json(const CheckArguments& arguments, const robotics::Measurements& measurements, const RobotCheck& check) {
  Json json = {{"robot", arguments.robot},
               {"data", arguments.data},
               {"poses", check.errors_mm.size()},
               {"same_session", arguments.same_session},
               {"still_good", check.still_good},
               {"error_mm", figures_json(check.error)},
               {"accuracy_mm", check.accuracy_mm},
               {"limit_mm", check.limit_mm},
               {"uncovered", uncovered_json(measurements, check)},
               {"moved", moved_json(check.moved)}};
  json["refitted_mm"] = check.refitted_mm;
  json["noise_mm"] = check.noise_mm;
  json["noise_before_mm"] = check.noise_before_mm > 0.0 ? Json(check.noise_before_mm) : Json(nullptr);
  json["unexplained"] = check.unexplained;
  json["tested"] = check.tested;
  json["unseen"] = check.unseen;
  return json;
}

// The robot for a file of one session that it need not know, whose frames are fitted anyway.
robotics::Robot for_any_session(robotics::Robot robot) {
  robotics::Chain& chain = robot.chain;
  std::erase_if(chain.tools, [&](const robotics::NamedFrame& tool) {
    return std::ranges::any_of(chain.bases, [&](const robotics::NamedFrame& base) {
      return tool.name == base.name || tool.name.starts_with(base.name + "/");
    });
  });
  chain.bases.clear();
  chain.session.clear();
  return robot;
}

// What calibrations refuse of the number of poses or of the description is said with the names of the files.
RobotCheck checked(const CheckArguments& arguments, const robotics::CorrectedRobot& robot,
                   const robotics::Measurements& measurements, const robotics::CheckOptions& options) {
  try {
    return robotics::check_robot(robot, measurements, options);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}, {}: {}", arguments.robot, arguments.data, error.what()));
  }
}

void check_command(const CheckArguments& arguments) {
  if (robotics::is_urdf(arguments.robot)) {
    throw std::runtime_error(
        fmt::format("{}: a URDF does not say how sure its values are; give the description (YAML) that calibrate or "
                    "discover wrote beside it",
                    arguments.robot));
  }
  constexpr const char* order = "the calibrated description (YAML) comes first, then the measurements (CSV)";
  if (robotics::is_urdf(arguments.data)) refuse_exchanged(arguments.robot, arguments.data, order);
  robotics::CorrectedRobot robot =
      read_unless_exchanged(arguments.robot, arguments.data, order,
                            [](const std::string& path) { return robotics::read_corrected_robot(path); });
  if (!arguments.same_session) robot.robot = for_any_session(robot.robot);
  const robotics::Measurements measurements =
      read_measured(arguments.data, robot.robot, {}, {.columns = arguments.columns, .mark = arguments.mark});
  for (std::size_t row = 0; row < measurements.poses.observations.size() && !arguments.same_session; ++row) {
    const std::string& base = measurements.poses.observations[row].base;
    if (!robotics::is_touched(base)) continue;
    throw std::runtime_error(
        fmt::format("{}:{}: the place of {} is known only while the robot stays where it was; if it did, give "
                    "--same-session",
                    arguments.data, measurements.lines[row], base));
  }
  check_frames(arguments.data, robot.robot, measurements,
               arguments.same_session ? "" : "; check judges a file of one session and known targets");
  check_positions(arguments.robot, robot.robot, measurements.poses);
  robotics::CheckOptions options{.same_session = arguments.same_session, .accuracy_mm = {}, .level = arguments.level};
  if (arguments.accuracy_mm > 0.0) options.accuracy_mm = arguments.accuracy_mm;
  const RobotCheck check = checked(arguments, robot, measurements, options);
  constexpr double implausible_share = 0.02;
  if (check.error.mean > implausible_share * robotics::reach_of(robot.robot.chain)) {
    throw std::runtime_error(fmt::format(
        "{}: the robot misses the points by {:.0f} mm on average, base and tool {}: these are not measurements of it; "
        "check units, signs and order of the columns",
        arguments.data, check.error.mean, arguments.same_session ? "as calibrated" : "fitted to them"));
  }
  if (arguments.json) {
    print_json(check_json(arguments, measurements, check));
  } else {
    for (const std::string& warning : measurements.warnings) print("Note: " + warning + "\n");
    print_check(arguments, robot.robot, measurements, check);
  }
  if (!check.still_good) {
    throw std::runtime_error(fmt::format("{}: the mean error is {:.4f} mm, more than {:.4f} mm", arguments.data,
                                         check.error.mean, check.limit_mm));
  }
}

}  // namespace

void add_check(CLI::App& app) {
  CLI::App* command = app.add_subcommand("check",
                                         "Is a calibrated robot still good? What of it moved?\n"
                                         "Judges a description that calibrate wrote by new measurements, and names the "
                                         "parameters and effects that changed. "
                                         "The exit code is 1 where the mean error is beyond what was stated.");
  command->footer("Example: llmt-robot check calibrated.yaml measured_today.csv --accuracy-mm 0.1");
  const auto arguments = std::make_shared<CheckArguments>();
  add_input_file(*command, "model", arguments->robot, "Calibrated description (YAML)")->required();
  add_input_file(*command, "data", arguments->data, "New measurements (CSV with units in the column names)")
      ->required();
  command->add_flag("--same-session", arguments->same_session,
                    "Instrument and target stand where they stood at the calibration: base and tool are kept");
  add_number(*command, "--accuracy-mm", arguments->accuracy_mm, above_zero,
             "Mean error up to which the robot is good (default: as at calibration, see docs/commands.md)");
  add_number(*command, "--level", arguments->level, NumberRange{1e-6, 0.5, "a number from 1e-6 to 0.5"},
             "Probability that something is said to have moved although nothing has")
      ->capture_default_str();
  add_column_map(*command, arguments->columns);
  add_decimal_comma(*command, arguments->mark);
  command->add_flag("--json", arguments->json, "Print the result as JSON");
  command->callback([arguments] { check_command(*arguments); });
}

}  // namespace llmt::apps
