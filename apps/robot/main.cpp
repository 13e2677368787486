#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>

#include "llmt/robotics/robot_file.hpp"
#include "robot/commands.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

void llmt::apps::check_positions(const std::string& file, const robotics::Robot& robot, const robotics::Poses& poses) {
  const std::string reason = robotics::position_refusal(robot, poses);
  if (!reason.empty()) throw std::runtime_error(file + ": " + reason);
}

void llmt::apps::check_frames(const std::string& file, const robotics::Robot& robot,
                              const robotics::Measurements& measurements, const std::string& advice) {
  const auto lacks = [](const std::vector<robotics::NamedFrame>& frames, const std::string& name) {
    return !name.empty() && std::ranges::find(frames, name, &robotics::NamedFrame::name) == frames.end();
  };
  const std::vector<robotics::Observation>& observations = measurements.poses.observations;
  for (std::size_t row = 0; row < observations.size(); ++row) {
    const bool is_session = lacks(robot.chain.bases, observations[row].base);
    if (!is_session && !lacks(robot.chain.tools, observations[row].tool)) continue;
    const std::string& base = observations[row].base;
    if (is_session && robotics::is_touched(base)) {
      throw std::runtime_error(fmt::format("{}:{}: the {} was not part of the calibration, and shows nothing by itself",
                                           file, measurements.lines[row], base));
    }
    throw std::runtime_error(fmt::format("{}:{}: {} \"{}\" was not part of the calibration{}", file,
                                         measurements.lines[row], is_session ? "session" : "target",
                                         is_session ? base : observations[row].tool, advice));
  }
}

llmt::robotics::Robot llmt::apps::read_description(const std::string& robot, const std::string& measured,
                                                   const robotics::UrdfLinks& links) {
  constexpr const char* order = "the description (YAML or URDF) comes first, then the measurements (CSV)";
  // A URDF is known by its name: to read one may need options.
  if (robotics::is_urdf(measured) && !robotics::is_urdf(robot)) refuse_exchanged(robot, measured, order);
  return read_unless_exchanged(robot, measured, order,
                               [&](const std::string& path) { return robotics::read_robot(path, links); });
}

llmt::robotics::CorrectedRobot llmt::apps::read_arm(const std::string& path, const robotics::UrdfLinks& links) {
  robotics::CorrectedRobot robot = robotics::read_corrected_robot(path, links);
  const std::vector<robotics::Effect> all = robot.robot.effects;
  robot.robot = robotics::without_errors_of_measuring(std::move(robot.robot));
  std::vector<std::string> titles;
  for (const robotics::Effect& effect : all) {
    if (robotics::effect_type(effect.type).of_measuring) titles.push_back(robotics::effect_type(effect.type).title);
  }
  if (!titles.empty()) {
    warn(fmt::format("{}: left out, because they were errors of the measurement and not of the arm: {}", path,
                     fmt::join(titles, ", ")));
  }
  return robot;
}

void llmt::apps::name_made_up(const robotics::Poses& given, const robotics::Poses& completed) {
  std::vector<std::string> names;
  for (const auto& [name, values] : completed.covariates) {
    if (!given.covariates.contains(name)) names.push_back(name);
  }
  if (names.empty()) return;
  warn(
      fmt::format("Columns that effects need and the table does not have: {}. Directions and moves are those of going "
                  "from row to row, order counts the rows, everything else is neutral (docs/commands.md)",
                  fmt::join(names, ", ")));
}

void llmt::apps::add_urdf_links(CLI::App& command, robotics::UrdfLinks& links) {
  command.add_option("--base-link", links.base, "Link of a URDF where the arm begins (default: the root)");
  command.add_option("--tip-link", links.tip, "Link of a URDF that is the tool (default: the end of the only chain)");
}

std::string llmt::apps::with_decimal_mark(std::string csv, DecimalMark mark) {
  if (mark == DecimalMark::point) return csv;
  bool is_quoted = false;
  bool is_header = true;
  for (char& c : csv) {
    if (c == '"') is_quoted = !is_quoted;
    if (is_quoted) continue;
    if (c == '\n') is_header = false;
    c = c == ',' ? ';' : c == '.' && !is_header ? ',' : c;
  }
  return csv;
}

llmt::robotics::UrdfLinks llmt::apps::links_for(const std::string& path, const robotics::UrdfLinks& given,
                                                const robotics::Robot& robot) {
  if (!robotics::is_urdf(path)) return {};
  return given.base.empty() && given.tip.empty() ? robot.urdf_links : given;
}

int main(int argc, char** argv) {
  CLI::App app{"Calibrate a robot from measured positions, learn what its model misses, and remove it.", "llmt-robot"};
  app.require_subcommand(1);
  app.set_help_all_flag("--help-all", "Help with all options, also those for experts");
  llmt::apps::add_demo(app);
  llmt::apps::add_paper(app);
  llmt::apps::add_simulate(app);
  llmt::apps::add_poses(app);
  llmt::apps::add_calibrate(app);
  llmt::apps::add_check(app);
  llmt::apps::add_discover(app);
  llmt::apps::add_predict(app);
  llmt::apps::add_compensate(app);
  llmt::apps::add_robot_export(app);
  llmt::apps::add_mechanism(app);
  return llmt::apps::run(app, argc, argv);
}
