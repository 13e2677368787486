#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/kinematics.hpp"
#include "llmt/robotics/robot_c_source.hpp"
#include "llmt/robotics/robot_file.hpp"
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
  bool c = false;
};

// What is that small is the rounding of sums and products.
double without_rounding(double value, double smallest) { return std::abs(value) < smallest ? 0.0 : value; }

// Of the joint's moving frame at zero.
Eigen::Isometry3d joint_frame(const robotics::Chain& chain, const robotics::Skeleton& zero, std::size_t joint) {
  constexpr double radians = 0.017453292519943295;
  const robotics::Joint& of = chain.joints[joint];
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() = zero.joint_frame[joint];
  frame.translation() = zero.joint_origin[joint];
  if (of.type == robotics::JointType::revolute) {
    frame.rotate(Eigen::AngleAxisd(radians * of.theta_deg, Eigen::Vector3d::UnitZ()));
  }
  if (of.sign < 0.0) frame.rotate(Eigen::AngleAxisd(3.141592653589793, Eigen::Vector3d::UnitX()));
  return frame;
}

std::string origin_text(const std::string& name, const Eigen::Isometry3d& pose) {
  const Eigen::Vector3d rpy = robotics::roll_pitch_yaw(pose.linear());
  const Eigen::Vector3d xyz = 0.001 * pose.translation();
  const auto shown = [](double value) { return without_rounding(value, 1e-12); };  // m and rad
  return fmt::format("  {}: {{x: {}, y: {}, z: {}, roll: {}, pitch: {}, yaw: {}}}\n", name, shown(xyz(0)),
                     shown(xyz(1)), shown(xyz(2)), shown(rpy(0)), shown(rpy(1)), shown(rpy(2)));
}

std::string kinematics_yaml(const robotics::Chain& described) {
  robotics::Chain chain = described;
  chain.base = {};
  const robotics::Kinematics kinematics(chain);
  const robotics::Skeleton zero = kinematics.skeleton(Eigen::VectorXd::Zero(std::ssize(chain.joints)));
  std::string text =
      "# Pose of each joint in the frame of the one before, the first in the base, at zero; m and rad; fixed-axis "
      "roll,\n"
      "# pitch, yaw as in URDF. Every axis is z. tool: in the frame of the last joint.\n";
  for (const robotics::Joint& joint : chain.joints) {
    if (!joint.mimic) continue;
    text += fmt::format("# {} has no drive: its value is {} times that of {}, plus {} {}.\n", joint.name,
                        joint.mimic->multiplier, joint.mimic->joint, joint.mimic->offset, robotics::limit_unit(joint));
  }
  text += "kinematics:\n";
  Eigen::Isometry3d before = Eigen::Isometry3d::Identity();
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const Eigen::Isometry3d frame = joint_frame(chain, zero, j);
    text += origin_text(chain.joints[j].name, before.inverse() * frame);
    before = frame;
  }
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();
  tool.linear() = zero.tool.rotation;
  tool.translation() = zero.tool.position_mm;
  return text + origin_text("tool", before.inverse() * tool);
}

std::string deltas_csv(const robotics::Chain& chain, const robotics::Chain& nominal) {
  if (chain.convention != nominal.convention || chain.joints.size() != nominal.joints.size()) {
    throw std::invalid_argument("--deltas: the two descriptions differ in convention or number of joints");
  }
  std::string text = "joint,delta_theta_deg,delta_d_mm,delta_a_mm,delta_b_mm,delta_alpha_deg,delta_beta_deg\n";
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const robotics::Joint& now = chain.joints[j];
    const robotics::Joint& was = nominal.joints[j];
    const auto delta = [](double here, double there) { return without_rounding(here - there, 1e-9); };
    text += fmt::format("{},{},{},{},{},{},{}\n", now.name, delta(now.theta_deg, was.theta_deg),
                        delta(now.d_mm, was.d_mm), delta(now.a_mm, was.a_mm), delta(now.b_mm, was.b_mm),
                        delta(now.alpha_deg, was.alpha_deg), delta(now.beta_deg, was.beta_deg));
  }
  return text;
}

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

void export_command(const ExportArguments& arguments) {
  const int wanted = static_cast<int>(arguments.kinematics) + static_cast<int>(!arguments.deltas_from.empty()) +
                     static_cast<int>(arguments.c);
  if (wanted != 1) throw std::invalid_argument("give one of --c, --kinematics and --deltas");
  if (arguments.c) {
    export_c(arguments);
    return;
  }
  const robotics::Robot robot = robotics::read_robot(arguments.robot, links_for(arguments.robot, arguments.links, {}));
  std::string text;
  if (arguments.kinematics) {
    text = kinematics_yaml(robot.chain);
  } else {
    const robotics::UrdfLinks links = links_for(arguments.deltas_from, arguments.links, robot);
    text = deltas_csv(robot.chain, robotics::read_robot(arguments.deltas_from, links).chain);
  }
  if (arguments.output.empty()) {
    print_bytes(text);
  } else {
    write_file(arguments.output, text);
  }
  if (!robot.effects.empty() || !robot.correction_file.empty()) {
    warn("The table holds the geometry alone: effects and correction are left out; llmt-robot compensate has them");
  }
  if (const std::string uncertain = report::uncertain_text(robot); !uncertain.empty()) {
    warn(fmt::format(
        "Uncertain values: {}. Calibration could not determine each of them alone, so do not take them for the true "
        "ones. Load all values of the table into the controller, or none",
        uncertain));
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
  add_output_file(*command, "-o,--output", arguments->output, "File to write (default: standard output)");
  command->callback([arguments] { export_command(*arguments); });
}

}  // namespace llmt::apps
