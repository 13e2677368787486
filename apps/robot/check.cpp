#include <fmt/format.h>

#include <memory>
#include <stdexcept>

#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/urdf.hpp"
#include "report/robot/check_run.hpp"
#include "robot/commands.hpp"
#include "robot/measured_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

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
  if (!arguments.same_session) robot.robot = report::for_any_session(robot.robot);
  const robotics::Measurements measurements =
      read_measured(arguments.data, robot.robot, {}, {.columns = arguments.columns, .mark = arguments.mark});
  robotics::CheckOptions options{.same_session = arguments.same_session, .accuracy_mm = {}, .level = arguments.level};
  if (arguments.accuracy_mm > 0.0) options.accuracy_mm = arguments.accuracy_mm;
  const robotics::RobotCheck check = report::run_check(arguments.robot, arguments.data, robot, measurements, options);
  const report::CheckFacts facts{arguments.robot, arguments.data, robot.robot, measurements, options, check};
  if (arguments.json) {
    print_json(report::check_json(facts));
  } else {
    print(report::check_text(facts));
  }
  if (const std::string refusal = report::check_refusal(facts); !refusal.empty()) throw std::runtime_error(refusal);
  if (check.verdict == robotics::CheckVerdict::moved_within_limits) throw ExitCode{exit_changed};
}

}  // namespace

void add_check(CLI::App& app) {
  CLI::App* command = app.add_subcommand("check",
                                         "Is a calibrated robot still good? What of it moved?\n"
                                         "Judges a description that calibrate wrote by new measurements, and names the "
                                         "parameters and effects that changed. "
                                         "Exit codes: 0 still good, 1 no longer good, 3 moved but within limits, 4 not "
                                         "evaluated.");
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
