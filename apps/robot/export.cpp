#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "llmt/files.hpp"
#include "llmt/robotics/robot_c_source.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "report/robot/controller_tables.hpp"
#include "robot/commands.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

struct ExportArguments {
  std::string robot;
  robotics::UrdfLinks links;
  std::string deltas_from;
  std::string origins_of;
  std::string session;
  std::string target;
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
  robotics::CorrectedRobot robot = read_arm(arguments.robot, arguments.links);
  robot.robot.chain = robotics::in_session(std::move(robot.robot.chain), arguments.session, arguments.target);
  const CSource c = source_of(robot, arguments, std::filesystem::path(header).filename().string());
  const std::vector<NewFile> files = {{arguments.output, c.source}, {header, c.header}};
  write_files(files);
  print(fmt::format("{}: {} joints, {} effects, {} correction; conditions: {}; positions {}; written to {} and {}\n",
                    robot.robot.chain.name, robot.robot.chain.joints.size(), robot.robot.effects.size(),
                    robot.correction ? "with a" : "no", fmt::join(robotics::c_conditions(robot.robot), ", "),
                    report::frames_text(robot.robot.chain), arguments.output, header));
}

void export_command(const ExportArguments& arguments) {
  const int wanted = static_cast<int>(arguments.kinematics) + static_cast<int>(!arguments.deltas_from.empty()) +
                     static_cast<int>(arguments.c);
  if (wanted != 1) throw std::invalid_argument("give one of --c, --kinematics and --deltas");
  if (arguments.c) {
    export_c(arguments);
    return;
  }
  robotics::CorrectedRobot whole =
      robotics::read_corrected_robot(arguments.robot, links_for(arguments.robot, arguments.links, {}));
  whole.robot.chain = robotics::in_session(std::move(whole.robot.chain), arguments.session, arguments.target);
  const std::string& other = arguments.kinematics ? arguments.origins_of : arguments.deltas_from;
  std::optional<robotics::Chain> nominal;
  if (!other.empty()) nominal = robotics::read_robot(other, links_for(other, arguments.links, whole.robot)).chain;
  const robotics::Chain* given = nominal ? &*nominal : nullptr;
  const std::string text = report::geometry_table(whole,
                                                  {.deltas_from = arguments.kinematics ? nullptr : given,
                                                   .zeros = arguments.zeros,
                                                   .origins_of = arguments.kinematics ? given : nullptr},
                                                  warn_of);
  if (arguments.output.empty()) {
    print_bytes(text);
  } else {
    write_file(arguments.output, text);
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
  CLI::Option* kinematics =
      command->add_flag("--kinematics", arguments->kinematics, "YAML with x, y, z, roll, pitch, yaw of each joint");
  add_input_file(*command, "--origins", arguments->origins_of,
                 "Names of the joints and places of their origins on the axes are those of this description")
      ->needs(kinematics);
  add_input_file(*command, "--deltas", arguments->deltas_from,
                 "CSV with the differences of the parameters from those of this description");
  command
      ->add_flag("--zeros", arguments->zeros,
                 "Zeros of the joints alone, fitted anew: for controllers that take mastering offsets and no more")
      ->needs("--deltas");
  command->add_option(
      "--session", arguments->session,
      "Whose base is exported, where the robot was calibrated in several sessions (default: the first)");
  command->add_option("--target", arguments->target,
                      "What the tool is, where the robot was calibrated with several targets (default: the first)");
  add_output_file(*command, "-o,--output", arguments->output, "File to write (default: standard output)");
  command->callback([arguments] { export_command(*arguments); });
}

}  // namespace llmt::apps
