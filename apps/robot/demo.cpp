#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/rigid_arm.hpp"
#include "llmt/robotics/robot_check.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "report/robot/discovery/effect_text.hpp"
#include "robot/commands.hpp"
#include "robot/shipped_robots.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

constexpr std::uint64_t program_seed = 7;

// Shows a command and does what it does, silently.
void run_command(const std::string& line) {
  print(fmt::format("$ llmt-robot {}\n", line));
  CLI::App app;
  add_simulate(app);
  add_calibrate(app);
  add_discover(app);
  add_compensate(app);
  add_check(app);
  const Silence silence;
  app.parse(line);
}

// What a controller would be asked for: poses that took no part in anything, away from the limits.
std::string program_csv(robotics::Robot robot) {
  constexpr double share = 0.6;
  for (robotics::Joint& joint : robot.chain.joints) {
    for (double& limit : *joint.limits) limit *= share;
  }
  const robotics::Poses poses = robotics::simulate(robot, {.poses = 100, .seed = program_seed}).poses;
  std::string text = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n";
  for (const auto pose : poses.joints.rowwise()) {
    std::vector<std::string> cells;
    for (Eigen::Index j = 0; j < pose.size(); ++j) {
      cells.push_back(fmt::format("{:.3f}", pose(j) * robotics::to_limit_unit(robot.chain.joints[j])));
    }
    text += fmt::format("{}\n", fmt::join(cells, ","));
  }
  return text;
}

// How far the real arm ends from where the nominal one would be, in the frames in which it is nearest to the model.
robotics::ErrorFigures missed(const std::string& model, const std::string& commands) {
  const robotics::Robot real = robotics::read_robot("real_arm.yaml");
  robotics::Robot nominal = robotics::read_robot("arm.yaml");
  nominal.chain = robotics::with_fitted_frames(nominal.chain, robotics::read_corrected_robot(model));
  const Eigen::MatrixXd asked = robotics::positions(nominal, robotics::read_poses("program.csv", nominal));
  const Eigen::MatrixXd reached = robotics::positions(real, robotics::read_poses(commands, real));
  return robotics::error_figures((reached - asked).rowwise().norm());
}

std::string effects_of(const robotics::Robot& robot) {
  std::vector<std::string> words;
  for (const robotics::Effect& effect : robot.effects) {
    words.push_back(
        fmt::format("{} ({} urad/(N m))", report::effect_words(effect), number(1e6 * effect.values.front(), 3)));
  }
  return words.empty() ? "nothing" : fmt::format("{}", fmt::join(words, ", "));
}

void calibrate_and_discover() {
  print(
      "\n1. Measure. Here a simulated tracker with noise of 20 um sees 150 poses of real_arm.yaml, which stands for "
      "the "
      "real arm: its joints are a little off and two of them bend. Nothing below knows that file.\n");
  run_command("simulate real_arm.yaml --poses 150 --noise-um 20 -o measured.csv");
  print("\n2. Calibrate: the geometry.\n");
  run_command("calibrate arm.yaml measured.csv -o calibrated.yaml");
  const robotics::Robot calibrated = robotics::read_robot("calibrated.yaml");
  print(fmt::format("   mean error on poses left out: {:.4f} mm\n", calibrated.calibration->held_out_mm.value()));
  print("\n3. Discover what the description lacks.\n");
  run_command("discover arm.yaml measured.csv -o improved.yaml");
  print(fmt::format("   found: {}\n   there: {}\n", effects_of(robotics::read_robot("improved.yaml")),
                    effects_of(robotics::read_robot("real_arm.yaml"))));
}

void compensate_and_check() {
  print("\n4. Compensate: commands for 100 poses of a program, of which none was measured.\n");
  run_command("compensate calibrated.yaml program.csv --nominal arm.yaml -o commands_calibrated.csv");
  run_command("compensate improved.yaml program.csv --nominal arm.yaml -o commands.csv");
  const robotics::ErrorFigures before = missed("improved.yaml", "program.csv");
  const robotics::ErrorFigures calibrated = missed("calibrated.yaml", "commands_calibrated.csv");
  const robotics::ErrorFigures after = missed("improved.yaml", "commands.csv");
  Table table({"   the real arm misses its targets by, mm", "mean", "max"});
  const auto add = [&](const char* name, const robotics::ErrorFigures& figures) {
    table.add({name, fmt::format("{:.4f}", figures.mean), fmt::format("{:.4f}", figures.max)});
  };
  add("   before: commanded as described", before);
  add("   calibrated", calibrated);
  add("   after: with what was found", after);
  print(table.text(output_width()));
  print(fmt::format("   {} times less than before\n", number(before.mean / after.mean, 3)));
  print("\n5. Later: is it still good?\n");
  run_command("simulate real_arm.yaml --poses 40 --noise-um 20 --seed 2 -o later.csv");
  run_command("check improved.yaml later.csv");
  print("   yes: it would have ended with exit code 1 otherwise, and have named what moved\n");
}

void demo_command(const std::string& folder) {
  const std::filesystem::path place(folder);
  if (std::filesystem::exists(place)) {
    throw std::invalid_argument(fmt::format("the folder {} is there already; -o names another one", folder));
  }
  std::error_code error;
  std::filesystem::create_directory(place, error);
  if (!error) std::filesystem::current_path(place, error);
  if (error) {
    throw std::runtime_error(fmt::format("{}: the folder cannot be made: {}", folder, error.message()));
  }
  write_file("arm.yaml", sample_arm_yaml);
  write_file("real_arm.yaml", sample_real_arm_yaml);
  write_file("program.csv", program_csv(robotics::read_robot("arm.yaml")));
  print(
      fmt::format("An arm is calibrated, what its model lacks is found, and its errors are removed. All files are in "
                  "{}, and the commands can be given there again:\n$ cd {}\n",
                  folder, folder));
  calibrate_and_discover();
  compensate_and_check();
  print(
      "\nWith your own arm: its description or URDF instead of arm.yaml, your measurements instead of measured.csv. "
      "llmt-robot poses says which poses to measure.\n");
}

}  // namespace

void add_demo(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "demo",
      "See in seconds what this program does, on a simulated arm\n"
      "Calibrates a simulated arm, discovers what its model lacks and compensates its errors on poses that were not "
      "measured. Each step shows the command that does it; the files are real ones.");
  command->footer("Example: llmt-robot demo -o llmt_demo");
  const auto folder = std::make_shared<std::string>("llmt_demo");
  command->add_option("-o,--output", *folder, "Folder to make for the files")->capture_default_str();
  command->callback([folder] { demo_command(*folder); });
}

}  // namespace llmt::apps
