#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/robotics/kinematics.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/pose_selection.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "robot/commands.hpp"
#include "robot/measured_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

using robotics::PoseSelection;

constexpr std::array criteria = {"position", "O1", "O2", "O3", "O4", "O5"};
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
  std::string criterion = criteria[0];
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
  if (!arguments.tool.empty()) robot.chain.tool.xyz_mm = Eigen::Vector3d(arguments.tool.data());
  // The next poses are of one session and one target.
  robot.chain.bases.clear();
  robot.chain.tools.clear();
  return robot;
}

robotics::PosePlan plan_of(const PosesArguments& arguments, const robotics::Robot& robot) {
  const robotics::ColumnMap map = column_map(arguments.columns);
  const auto read = [&](const std::string& path, const robotics::ColumnMap& meant = {}) {
    return path.empty() ? robotics::Poses() : robotics::read_poses(path, robot, arguments.mark, meant);
  };
  return {read(arguments.from), read(arguments.measured, map), read(arguments.use)};
}

// Thousandths of a degree or micrometres, unless that is beyond a limit.
double rounded(double value, const robotics::Joint& joint) {
  const double near = std::round(1e3 * value) * 1e-3;
  const bool is_beyond = joint.limits && (near < joint.limits->at(0) || near > joint.limits->at(1));
  return is_beyond ? value : near;
}

std::string poses_csv(const robotics::Robot& robot, const robotics::Poses& poses) {
  const std::vector<robotics::JointColumn> columns = robotics::joint_columns(robot.chain);
  std::vector<std::string> names;
  for (std::size_t j = 0; j < columns.size(); ++j) {
    if (!robot.chain.joints[j].mimic) names.push_back(robotics::csv_field(columns[j].name));  // a mimic has no drive
  }
  for (const auto& [name, values] : poses.covariates) {
    if (!robotics::is_move(name)) names.push_back(name);
  }
  std::string text = fmt::format("{}\n", fmt::join(names, ","));
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    std::vector<std::string> cells;
    for (std::size_t j = 0; j < robot.chain.joints.size(); ++j) {
      const robotics::Joint& joint = robot.chain.joints[j];
      if (joint.mimic) continue;
      cells.push_back(fmt::format("{:.12g}", rounded(poses.joints(i, j) * robotics::to_limit_unit(joint), joint)));
    }
    for (const auto& [name, values] : poses.covariates) {
      if (!robotics::is_move(name)) cells.push_back(fmt::format("{}", values(i)));
    }
    text += fmt::format("{}\n", fmt::join(cells, ","));
  }
  return text;
}

// Then the joint's own angle, and a part of what is before it, cannot be found.
bool is_on_last_axis(const robotics::Chain& chain) {
  const auto last = std::ssize(chain.joints) - 1;
  const Eigen::VectorXd any = Eigen::VectorXd::Zero(last + 1);
  constexpr double nothing_mm = 1e-6;
  return chain.joints[last].type == robotics::JointType::revolute &&
         robotics::Kinematics(chain).joint_jacobian(any).col(last).head(3).norm() < nothing_mm;
}

std::string use_words(const PosesArguments& arguments) {
  if (!arguments.use.empty()) return "over the poses of " + arguments.use;
  if (!arguments.from.empty()) return "over the candidates";
  return arguments.box.empty() ? "over random poses within the joint limits"
                               : "over random poses within limits and box";
}

std::string expectations(const PoseSelection& selection, bool with_indices) {
  const robotics::Observability& chosen = selection.chosen.observability;
  const robotics::Observability& random = selection.random.observability;
  Table table({"expected after calibration", "chosen", "random"});
  const auto add = [&](const std::string& name, double with_chosen, double with_random) {
    table.add({name, number(with_chosen, 4), number(with_random, 4)});
  };
  add("error of the tool position, mm", selection.chosen.position_mm, selection.random.position_mm);
  if (!with_indices) return table.text(output_width());
  add("O1", chosen.o1, random.o1);
  add("O2", chosen.o2, random.o2);
  add("O3", chosen.o3, random.o3);
  add("O4", chosen.o4, random.o4);
  add("O5", chosen.o5, random.o5);
  add("condition", chosen.condition, random.condition);
  return table.text(output_width());
}

std::string expected_errors(const PoseSelection& selection) {
  Table table({"parameter", "std error, chosen", "random", "unit"});
  for (std::size_t k = 0; k < selection.chosen.parameters.size(); ++k) {
    const robotics::PredictedCalibration::Parameter& parameter = selection.chosen.parameters[k];
    table.add({parameter.name, number(parameter.standard_error, 3),
               number(selection.random.parameters[k].standard_error, 3), parameter.unit});
  }
  return table.text(output_width());
}

void print_selection(const PosesArguments& arguments, const robotics::Robot& robot, const robotics::PosePlan& plan,
                     const PoseSelection& selection) {
  const std::string with =
      plan.measured.count() > 0 ? fmt::format(" beside the {} measured ones", plan.measured.count()) : "";
  print(fmt::format("{}: {} poses chosen{} to identify {} parameters; criterion: {}\n\n", robot.chain.name,
                    selection.poses.count(), with, selection.chosen.parameters.size(),
                    arguments.criterion == criteria[0] ? "error of the tool position" : arguments.criterion));
  const bool with_indices = arguments.criterion != criteria[0];
  print(expectations(selection, with_indices));
  print(fmt::format(
      "Error of the tool position: root mean square {}, for noise of {} um in each coordinate; the noise "
      "alone, no error of the model. {} get below {} mm. Random: the median of 25 draws.\n{}\n",
      use_words(arguments), number(arguments.noise_um),
      arguments.from.empty() ? fmt::format("As far as the search sees, no {} poses", selection.poses.count())
                             : fmt::format("No {} of the candidates", selection.poses.count()),
      number(selection.bound_mm, 4),
      with_indices ? "O1 to O5: the larger the better; derivatives over the noise, parameters in units of 1 mm and 0.1 "
                     "deg (those of effects: their scales), the identifiable ones.\n"
                   : ""));
  print(expected_errors(selection));
  std::vector<std::string> dependent;
  for (const robotics::FixedParameter& fixed : selection.fixed) {
    if (fixed.why != "fixed by the user") dependent.push_back(fixed.name);
  }
  print(fmt::format("\nNot to be found from positions, or told apart from those above: {}\n",
                    fmt::join(dependent, ", ")));
  if (is_on_last_axis(robot.chain)) {
    print(
        fmt::format("The measured point lies on the last axis, so {} does not move it. If the target is beside the "
                    "axis, --tool x,y,z says where.\n",
                    robot.chain.joints.back().name));
  }
  if (!selection.left_out.empty()) {
    print(fmt::format("Taken as known, because the poses lack the columns that they depend on: {}\n",
                      fmt::join(selection.left_out, ", ")));
  }
  print(
      fmt::format("Order: from each pose to the nearest one; the largest joint moves add up to {} degrees. Collisions "
                  "and the line of sight are not checked.\n",
                  number(selection.travel_deg, 4)));
}

Json predicted_json(const robotics::PredictedCalibration& predicted) {
  const robotics::Observability& seen = predicted.observability;
  Json json = {{"position_error_mm", predicted.position_mm},
               {"o1", seen.o1},
               {"o2", seen.o2},
               {"o3", seen.o3},
               {"o4", seen.o4},
               {"o5", seen.o5},
               {"condition_number", seen.condition},
               {"parameters", Json::array()}};
  for (const robotics::PredictedCalibration::Parameter& parameter : predicted.parameters) {
    json["parameters"].push_back(
        {{"name", parameter.name}, {"unit", parameter.unit}, {"standard_error", parameter.standard_error}});
  }
  return json;
}

Json selection_json(const PosesArguments& arguments, const PoseSelection& selection) {
  Json json = {{"robot", arguments.robot},
               {"poses", selection.poses.count()},
               {"criterion", arguments.criterion},
               {"noise_um", arguments.noise_um},
               {"seed", arguments.options.seed},
               {"chosen", predicted_json(selection.chosen)},
               {"random", predicted_json(selection.random)},
               {"bound_mm", selection.bound_mm},
               {"travel_deg", selection.travel_deg},
               {"fixed", Json::array()},
               {"left_out", selection.left_out}};
  for (const robotics::FixedParameter& fixed : selection.fixed) {
    json["fixed"].push_back({{"name", fixed.name}, {"why", fixed.why}});
  }
  json["output"] = arguments.output.empty() ? Json(nullptr) : Json(arguments.output);
  return json;
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
  for (std::size_t k = 0; k < criteria.size(); ++k) {
    if (arguments.criterion == criteria[k]) options.criterion = static_cast<robotics::PoseCriterion>(k);
  }
  const robotics::PosePlan plan = plan_of(arguments, robot);
  const PoseSelection selection = robotics::select_poses(robot, plan, options);
  const std::string csv = poses_csv(robot, selection.poses);
  if (!arguments.output.empty()) write_file(arguments.output, csv);
  if (arguments.json) {
    print_json(selection_json(arguments, selection));
  } else if (arguments.output.empty()) {
    print_bytes(csv);
  } else {
    print_selection(arguments, robot, plan, selection);
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
      ->check(CLI::IsMember(std::vector<std::string>(criteria.begin(), criteria.end())))
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
