#include <fmt/format.h>

#include <memory>
#include <optional>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robot/commands.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

struct SimulateArguments {
  std::string robot;
  std::string output;
  std::string poses_from;
  bool json = false;
  robotics::SimulationOptions options;
};

robotics::Measurements simulated(const robotics::Robot& robot, const SimulateArguments& arguments) {
  std::optional<robotics::Poses> poses;
  if (!arguments.poses_from.empty()) poses = robotics::read_poses(arguments.poses_from, robot);
  try {
    return poses ? robotics::simulate(robot, *poses, arguments.options) : robotics::simulate(robot, arguments.options);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(arguments.robot + ": " + error.what());
  }
}

void simulate_command(const SimulateArguments& arguments) {
  const robotics::CorrectedRobot robot = robotics::read_corrected_robot(arguments.robot);
  robotics::Measurements measurements = simulated(robot.robot, arguments);
  if (robot.correction) {
    // The correction is part of what the description says of the robot.
    measurements.positions_mm +=
        robotics::positions(robot, measurements.poses) - robotics::positions(robot.robot, measurements.poses);
  }
  const std::string csv = robotics::to_csv(measurements, robot.robot);
  if (!arguments.output.empty()) {
    write_file(arguments.output, csv);
  } else if (!arguments.json) {
    print(csv);
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
  CLI::App* command = app.add_subcommand("simulate", "Make measurements of a robot that is not there");
  command->description(
      "Make measurements of a robot that is not there: poses uniform within the joint limits, tool positions with the "
      "effects of the\n"
      "description and normal noise. Columns that effects need are made up: order, temp_C at the reference, directions "
      "at random.");
  command->footer(
      "Example: llmt-robot simulate robotics/robots/tx200_like.yaml --poses 200 --noise-um 10 -o measured.csv");
  const auto arguments = std::make_shared<SimulateArguments>();
  command->add_option("robot", arguments->robot, "Robot description (YAML)")->required();
  CLI::Option* poses =
      command->add_option("--poses", arguments->options.poses, "Number of poses")->capture_default_str();
  command
      ->add_option("--poses-from", arguments->poses_from,
                   "CSV file whose joint values and covariates to take instead; measured positions in it do not matter")
      ->excludes(poses);
  command
      ->add_option("--noise-um", arguments->options.noise_um, "Standard deviation of each coordinate, in micrometres")
      ->capture_default_str();
  command->add_option("--seed", arguments->options.seed, "Of poses and noise")->capture_default_str();
  command->add_option("-o,--output", arguments->output, "CSV file to write (default: standard output)");
  command->add_flag("--json", arguments->json, "Print a summary as JSON; with it the measurements go to -o only");
  command->callback([arguments] { simulate_command(*arguments); });
}

}  // namespace llmt::apps
