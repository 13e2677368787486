#include <fmt/format.h>

#include <memory>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/pose_selection.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "report/robot/pose_report.hpp"
#include "robot/commands.hpp"
#include "robot/measured_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

constexpr Eigen::Index most_chosen = 1000;
constexpr NumberRange any_number = {-largest_number, largest_number, "a finite number"};
constexpr NumberRange spacing_range = {0.0, 179.0, "a number from 0 to 179"};

struct PosesArguments {
  std::string robot;
  robotics::UrdfLinks links;
  std::string from;
  std::string measured;
  std::string use;
  std::vector<double> box;
  std::vector<double> tool;
  std::string criterion = report::pose_criteria[0];
  double noise_um = 50.0;
  robotics::PoseSelectionOptions options;
  std::string columns;
  DecimalMark mark = DecimalMark::point;
  std::string output;
  bool json = false;
};

void require_numbers(const char* option, const std::vector<double>& values, std::size_t count, const char* what) {
  if (values.empty() || values.size() == count) return;
  throw std::invalid_argument(fmt::format("{}: {} numbers, must be {}: {}", option, values.size(), count, what));
}

robotics::Robot described(const PosesArguments& arguments) {
  robotics::Robot robot = robotics::read_robot(arguments.robot, arguments.links);
  require_numbers("--tool", arguments.tool, 3, "x,y,z of the measured point on the flange, mm");
  return report::robot_to_measure(std::move(robot), arguments.tool);
}

robotics::PosePlan plan_of(const PosesArguments& arguments, const robotics::Robot& robot) {
  const robotics::ColumnMap map = column_map(arguments.columns);
  const auto read = [&](const std::string& path, const robotics::ColumnMap& meant = {}) {
    return path.empty() ? robotics::Poses() : robotics::read_poses(path, robot, arguments.mark, meant);
  };
  return {read(arguments.from), read(arguments.measured, map), read(arguments.use)};
}

void poses_command(PosesArguments arguments) {
  const robotics::Robot robot = described(arguments);
  require_numbers("--box", arguments.box, 6, "x_low,x_high,y_low,y_high,z_low,z_high of the tool point, mm");
  robotics::PoseSelectionOptions& options = arguments.options;
  if (!arguments.box.empty()) {
    const std::vector<double>& box = arguments.box;
    options.box = robotics::ToolBox{{box[0], box[2], box[4]}, {box[1], box[3], box[5]}};
  }
  options.noise_mm = 1e-3 * arguments.noise_um;
  options.criterion = report::pose_criterion(arguments.criterion);
  const robotics::PosePlan plan = plan_of(arguments, robot);
  ProgressBar bar("choosing poses");
  options.progress = bar.callback();
  const robotics::PoseSelection selection = robotics::select_poses(robot, plan, options);
  bar.clear();
  const std::string csv = report::poses_csv(robot, selection.poses);
  if (!arguments.output.empty()) write_file(arguments.output, csv);
  const report::PoseFacts facts{arguments.robot, arguments.from, arguments.use, arguments.noise_um,
                                robot,           plan,           options,       selection};
  if (arguments.json) {
    print_json(report::poses_json(facts, arguments.output));
  } else if (arguments.output.empty()) {
    print_bytes(csv);
  } else {
    print(report::poses_text(facts, output_width()));
    print(fmt::format("Written: {}\n", arguments.output));
  }
}

}  // namespace

void add_poses(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "poses",
      "Choose the poses to measure for a calibration\n"
      "Chooses those after whose calibration the tool position is known best where the arm will be used, within "
      "joint limits and box, or among candidates. Prints what is expected of them, and of as many random ones.");
  command->footer("Example: llmt-robot poses robotics/robots/tx200_like.yaml --count 40 -o poses.csv");
  const auto arguments = std::make_shared<PosesArguments>();
  robotics::PoseSelectionOptions& options = arguments->options;
  add_input_file(*command, "robot", arguments->robot, "Robot description (YAML or URDF)")->required();
  add_urdf_links(*command, arguments->links);
  add_count(*command, "--count", options.count, Eigen::Index{1}, "Number of poses", most_chosen)->capture_default_str();
  add_input_file(*command, "--from", arguments->from,
                 "CSV file of poses to choose from (default: all within joint limits and box)");
  add_input_file(*command, "--measured", arguments->measured,
                 "CSV file of poses that are measured already; those chosen add to them");
  add_input_file(*command, "--use", arguments->use,
                 "CSV file of poses at which the arm will be used (default: the candidates of --from, or else joint "
                 "limits and box)");
  add_numbers(*command, "--box", arguments->box, any_number,
              "x_low,x_high,y_low,y_high,z_low,z_high of the tool point in the frame of the robot's base, mm");
  add_numbers(*command, "--tool", arguments->tool, any_number,
              "x,y,z of the measured point on the flange, mm (default: the tool of the description)");
  add_number(*command, "--spacing", options.spacing_deg, spacing_range,
             "Degrees by which two poses differ in at least one joint")
      ->capture_default_str();
  command->add_option("--criterion", arguments->criterion, "What is made best: position, or an observability index")
      ->check(CLI::IsMember(std::vector<std::string>(report::pose_criteria.begin(), report::pose_criteria.end())))
      ->capture_default_str();
  add_number(*command, "--noise-um", arguments->noise_um, above_zero,
             "Standard deviation of each measured coordinate, in micrometres")
      ->capture_default_str();
  add_names(*command, "--fix", options.calibration.fixed, "PARAMETER",
            "What the calibration will keep as given: joint2.a, joint3, base, tool");
  add_names(*command, "--only", options.calibration.only, "PARAMETER", "Parameters that alone will be free");
  add_input_file(*command, "--columns", arguments->columns,
                 "Column map (YAML): what the columns of the measured file mean");
  add_decimal_comma(*command, arguments->mark);
  add_seed(*command, options.seed, "Of the random poses that the search begins with");
  add_output_file(*command, "-o,--output", arguments->output,
                  "CSV file of poses to write, in the order to drive (default: standard output)");
  command->add_flag("--json", arguments->json, "Print what is expected as JSON; with it the poses go to -o only");
  command->callback([arguments] { poses_command(*arguments); });
}

}  // namespace llmt::apps
