#include <fmt/format.h>

#include <memory>
#include <optional>

#include "llmt/files.hpp"
#include "llmt/limits.hpp"
#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "report/robot/arm_tables.hpp"
#include "robot/commands.hpp"
#include "robot/corrected_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

constexpr Eigen::Index most_poses = most(Limit::simulated_poses);

struct SimulateArguments {
  std::string robot;
  robotics::UrdfLinks links;
  std::string output;
  std::string poses_from;
  bool json = false;
  DecimalMark mark = DecimalMark::point;
  robotics::SimulationOptions options;
};

void simulate_command(const SimulateArguments& arguments) {
  const robotics::CorrectedRobot robot = robotics::read_corrected_robot(arguments.robot, arguments.links);
  refuse_lost_correction(robot.robot, arguments.robot, arguments.output);
  std::optional<robotics::Poses> poses;
  if (!arguments.poses_from.empty()) poses = robotics::read_poses(arguments.poses_from, robot.robot, arguments.mark);
  const robotics::Measurements measurements = report::simulated_table(arguments.robot, robot, poses, arguments.options);
  const std::string csv = robotics::to_csv(measurements, robot.robot);
  if (!arguments.output.empty()) {
    write_file(arguments.output, csv);
  } else if (!arguments.json) {
    print_bytes(csv);
  }
  if (arguments.json) {
    print_json({{"robot", arguments.robot},
                {"poses", measurements.count()},
                {"noise_um", arguments.options.noise_um},
                {"seed", arguments.options.seed},
                {"output", arguments.output.empty() ? Json(nullptr) : Json(arguments.output)}});
    return;
  }
  warn(fmt::format("{}: {} poses simulated, noise {} um, {} effects{}", robot.robot.chain.name, measurements.count(),
                   number(arguments.options.noise_um), robot.robot.effects.size(),
                   arguments.output.empty() ? "" : fmt::format(", written to {}", arguments.output)));
}

}  // namespace

void add_simulate(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "simulate",
      "Make measurements of a robot that is not there\n"
      "Poses are uniform within the joint limits; tool positions have the effects of the description and "
      "normal noise. Columns that effects need are made up: order, temp_C at the reference, directions at "
      "random.");
  command->footer(
      "Example: llmt-robot simulate robotics/robots/tx200_like.yaml --poses 200 --noise-um 10 -o measured.csv");
  const auto arguments = std::make_shared<SimulateArguments>();
  add_input_file(*command, "robot", arguments->robot, "Robot description (YAML or URDF)")->required();
  add_urdf_links(*command, arguments->links);
  CLI::Option* poses =
      add_count(*command, "--poses", arguments->options.poses, Eigen::Index{1}, "Number of poses", most_poses)
          ->capture_default_str();
  add_input_file(*command, "--poses-from", arguments->poses_from,
                 "CSV file whose joint values and covariates to take instead; measured positions in it do not matter")
      ->excludes(poses);
  add_decimal_comma(*command, arguments->mark);
  add_number(*command, "--noise-um", arguments->options.noise_um, not_negative,
             "Standard deviation of each coordinate, in micrometres")
      ->capture_default_str();
  add_seed(*command, arguments->options.seed, "Of poses and noise");
  add_output_file(*command, "-o,--output", arguments->output, "CSV file to write (default: standard output)");
  command->add_flag("--json", arguments->json, "Print a summary as JSON; with it the measurements go to -o only");
  command->callback([arguments] { simulate_command(*arguments); });
}

}  // namespace llmt::apps
