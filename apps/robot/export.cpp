#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/rigid_arm.hpp"
#include "llmt/robotics/robot_c_source.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "report/robot/controller_tables.hpp"
#include "report/robot/measurement_text.hpp"
#include "robot/commands.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

struct ExportArguments {
  std::string robot;
  robotics::UrdfLinks links;
  std::string deltas_from;
  std::string output;
  std::string name = "robot";
  bool kinematics = false;
  bool zeros = false;
  bool c = false;
};

// An effect that has no C source is a matter of the description, a name that is none of C one of usage.
CSource source_of(const robotics::CorrectedRobot& robot, const ExportArguments& arguments, const std::string& header) {
  try {
    return robotics::to_c(robot, arguments.name, header);
  } catch (const std::invalid_argument& error) {
    const std::string message = in_words_of_user(error.what(), {});
    if (!message.starts_with("effect ")) throw;
    throw std::runtime_error(arguments.robot + ": " + message);
  }
}

void export_c(const ExportArguments& arguments) {
  if (arguments.output.empty()) throw std::invalid_argument("--c needs --output: the source and its header are files");
  const std::string header = beside(arguments.output, ".h").string();
  if (header == arguments.output) throw std::invalid_argument("--output: the header has this name; write to FILE.c");
  refuse_lost_input(header, arguments.robot);
  const robotics::CorrectedRobot robot = read_arm(arguments.robot, arguments.links);
  const CSource c = source_of(robot, arguments, std::filesystem::path(header).filename().string());
  const std::vector<NewFile> files = {{arguments.output, c.source}, {header, c.header}};
  write_files(files);
  print(fmt::format("{}: {} joints, {} effects, {} correction; conditions: {}; written to {} and {}\n",
                    robot.robot.chain.name, robot.robot.chain.joints.size(), robot.robot.effects.size(),
                    robot.correction ? "with a" : "no", fmt::join(robotics::c_conditions(robot.robot), ", "),
                    arguments.output, header));
}

// Frames and the zeros of the joints: what a controller takes that knows mastering offsets alone.
std::vector<std::string> zeros_of(const robotics::Chain& chain) {
  std::vector<std::string> names = {"base", "tool"};
  for (const robotics::Joint& joint : chain.joints) {
    if (joint.mimic) continue;
    names.push_back(joint.name + (joint.type == robotics::JointType::revolute ? ".theta" : ".d"));
  }
  return names;
}

// How far the tool is off by what the table does not hold.
std::string loss_of(const robotics::CorrectedRobot& whole, const robotics::Robot& alone, bool zeros) {
  const robotics::Measurements seen = robotics::points_of_model(whole);
  const double mean = robotics::distances(robotics::positions(alone, seen.poses), seen).mean();
  return fmt::format(
      "The table holds {} alone, fitted anew to the whole model over the calibrated joint ranges, because values "
      "identified beside {} belong together. Without the rest the tool is {:.4f} mm off on average; llmt-robot "
      "compensate has all",
      zeros ? "the zeros of the joints" : "the geometry", zeros ? "the others" : "effects and correction", mean);
}

void export_command(const ExportArguments& arguments) {
  const int wanted = static_cast<int>(arguments.kinematics) + static_cast<int>(!arguments.deltas_from.empty()) +
                     static_cast<int>(arguments.c);
  if (wanted != 1) throw std::invalid_argument("give one of --c, --kinematics and --deltas");
  if (arguments.c) {
    export_c(arguments);
    return;
  }
  const robotics::CorrectedRobot whole =
      robotics::read_corrected_robot(arguments.robot, links_for(arguments.robot, arguments.links, {}));
  robotics::Robot robot = robotics::geometry_alone(whole);
  std::string text;
  if (arguments.kinematics) {
    text = report::kinematics_yaml(robot.chain);
  } else {
    const robotics::UrdfLinks links = links_for(arguments.deltas_from, arguments.links, whole.robot);
    const robotics::Chain nominal = robotics::read_robot(arguments.deltas_from, links).chain;
    if (arguments.zeros) robot.chain = robotics::fitted_to_model(nominal, whole, zeros_of(nominal));
    text = report::deltas_csv(robot.chain, nominal);
  }
  if (arguments.output.empty()) {
    print_bytes(text);
  } else {
    write_file(arguments.output, text);
  }
  const bool is_alone = !whole.robot.effects.empty() || whole.correction.has_value();
  if (is_alone || arguments.zeros) warn(loss_of(whole, robot, arguments.zeros));
  if (const std::string uncertain = report::uncertain_text(robot); !uncertain.empty()) {
    warn_of(report::uncertain_values_warning(uncertain));
  }
}

}  // namespace

void add_robot_export(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "export",
      "Write the arm for a controller: poses of the joints, changes of Denavit-Hartenberg parameters, or C source");
  command->footer("Example: llmt-robot export calibrated.yaml --deltas robotics/robots/ur10.yaml -o deltas.csv");
  const auto arguments = std::make_shared<ExportArguments>();
  add_input_file(*command, "robot", arguments->robot, "Robot description (YAML or URDF)")->required();
  add_urdf_links(*command, arguments->links);
  command->add_flag("--c", arguments->c,
                    "C99 source: forward model with effects and correction, and a step of compensate");
  command->add_option("--name", arguments->name, "Begins all names in the C source")->capture_default_str();
  command->add_flag("--kinematics", arguments->kinematics, "YAML with x, y, z, roll, pitch, yaw of each joint");
  add_input_file(*command, "--deltas", arguments->deltas_from,
                 "CSV with the differences of the parameters from those of this description");
  command
      ->add_flag("--zeros", arguments->zeros,
                 "Zeros of the joints alone, fitted anew: for controllers that take mastering offsets and no more")
      ->needs("--deltas");
  add_output_file(*command, "-o,--output", arguments->output, "File to write (default: standard output)");
  command->callback([arguments] { export_command(*arguments); });
}

}  // namespace llmt::apps
