#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "llmt/robotics/robot_check.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/urdf.hpp"
#include "report/robot/check_report.hpp"
#include "robot/commands.hpp"
#include "robot/measured_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

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
  const report::CheckFacts facts{arguments.robot, arguments.data, robot.robot, measurements, options, check};
  if (arguments.json) {
    print_json(report::check_json(facts));
  } else {
    print(report::check_text(facts));
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
