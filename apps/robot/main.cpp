#include "llmt/robotics/robot_file.hpp"
#include "report/robot/input_checks.hpp"
#include "robot/commands.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

llmt::robotics::Robot llmt::apps::read_description(const std::string& robot, const std::string& measured,
                                                   const robotics::UrdfLinks& links) {
  constexpr const char* order = "the description (YAML or URDF) comes first, then the measurements (CSV)";
  // A URDF is known by its name: to read one may need options.
  if (robotics::is_urdf(measured) && !robotics::is_urdf(robot)) refuse_exchanged(robot, measured, order);
  return read_unless_exchanged(robot, measured, order,
                               [&](const std::string& path) { return robotics::read_robot(path, links); });
}

llmt::robotics::CorrectedRobot llmt::apps::read_arm(const std::string& path, const robotics::UrdfLinks& links) {
  return report::arm_alone(path, robotics::read_corrected_robot(path, links), warn_of);
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
