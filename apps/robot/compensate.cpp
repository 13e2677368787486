#include <memory>
#include <sstream>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "report/robot/compensation_run.hpp"
#include "robot/commands.hpp"
#include "robot/measured_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

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

void compensate_command(const CompensateArguments& arguments) {
  const robotics::CorrectedRobot robot = read_arm(arguments.robot, links_for(arguments.robot, arguments.links, {}));
  const robotics::ColumnMap map = column_map(arguments.columns);
  const DecimalMark mark = map.decimal.value_or(arguments.mark);
  report::CompensationTask task{.robot_file = arguments.robot,
                                .targets_file = arguments.targets,
                                .nominal_file = arguments.nominal,
                                .in_base_frame = arguments.frame == "base",
                                .nominal_frames = arguments.nominal_frames,
                                .position_only = arguments.position_only,
                                .tolerance_mm = 1e-3 * arguments.tolerance_um};
  if (!arguments.nominal.empty()) {
    task.read_nominal = [&] {
      return robotics::read_robot(arguments.nominal, links_for(arguments.nominal, arguments.links, robot.robot)).chain;
    };
  }
  const report::CompensationRun run =
      report::run_compensation(robot, robotics::read_targets(arguments.targets, robot.robot, mark, map), task, warn_of);
  const std::string csv = with_decimal_mark(report::commands_csv(run), mark);
  if (!arguments.output.empty()) write_file(arguments.output, csv);
  if (arguments.json) {
    print_json(report::compensation_json(run, arguments.output));
  } else if (arguments.output.empty()) {
    print_bytes(csv);
    std::istringstream lines(report::compensation_text(run, ""));
    for (std::string line; std::getline(lines, line);) warn(line);
  } else {
    print(report::compensation_text(run, arguments.output) + "\n");
  }
  if (const auto refusal = report::compensation_refusal(run)) throw std::runtime_error(refusal->words({}));
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
  command->add_flag(
      "--nominal-frames", arguments->nominal_frames,
      "Base and tool are those of --nominal (default: fitted, so that the nominal arm is nearest to the robot)");
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
