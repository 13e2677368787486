#include <fmt/format.h>

#include <memory>

#include "llmt/files.hpp"
#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/measurements.hpp"
#include "report/robot/arm_tables.hpp"
#include "robot/commands.hpp"
#include "robot/measured_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

struct PredictArguments {
  std::string robot;
  robotics::UrdfLinks links;
  std::string poses;
  std::string output;
  bool as_measured = false;
  std::string columns;
  DecimalMark mark = DecimalMark::point;
};

void predict_command(const PredictArguments& arguments) {
  const robotics::CorrectedRobot robot = arguments.as_measured
                                             ? robotics::read_corrected_robot(arguments.robot, arguments.links)
                                             : read_arm(arguments.robot, arguments.links);
  const robotics::ColumnMap map = column_map(arguments.columns);
  const DecimalMark mark = map.decimal.value_or(arguments.mark);
  const auto [given, joint_columns] = robotics::read_pose_table(arguments.poses, robot.robot, mark, map);
  const robotics::Measurements predicted =
      report::predicted_table(arguments.robot, robot, given, map.orientation, warn_of);
  const std::string csv = with_decimal_mark(robotics::to_csv(predicted, robot.robot, joint_columns), mark);
  if (arguments.output.empty()) {
    print_bytes(csv);
  } else {
    write_file(arguments.output, csv);
  }
  warn(fmt::format("{}: {} poses, {} effects, {} correction; positions {}{}", robot.robot.chain.name, predicted.count(),
                   robot.robot.effects.size(), robot.correction ? "with a" : "no",
                   report::frames_text(robot.robot.chain, predicted.poses),
                   arguments.output.empty() ? "" : "; written to " + arguments.output));
}

}  // namespace

void add_predict(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "predict",
      "Say where a robot puts its tool\n"
      "The whole model: geometry, effects, correction. Joint values stand under the names and in the units of the "
      "table. Orientations are in the convention of the column map or the description (orientation: intrinsic_xyz and "
      "the like), or quaternions if these name none.");
  command->footer("Example: llmt-robot predict calibrated.yaml poses.csv -o positions.csv");
  const auto arguments = std::make_shared<PredictArguments>();
  add_input_file(*command, "robot", arguments->robot, "Robot description (YAML), as calibrate or discover wrote it")
      ->required();
  add_urdf_links(*command, arguments->links);
  add_input_file(*command, "poses", arguments->poses, "CSV file with joint values and the covariates of the effects")
      ->required();
  command->add_flag("--as-measured", arguments->as_measured,
                    "Keep errors of the instrument and its session, such as a drift: what would be read, not where "
                    "the tool is");
  add_column_map(*command, arguments->columns);
  add_decimal_comma(*command, arguments->mark);
  add_output_file(*command, "-o,--output", arguments->output, "CSV file to write (default: standard output)");
  command->callback([arguments] { predict_command(*arguments); });
}

}  // namespace llmt::apps
