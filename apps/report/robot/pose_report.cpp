#include "report/robot/pose_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "llmt/robotics/kinematics.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::report {
namespace {

std::string criterion_name(const robotics::PoseSelectionOptions& options) {
  return pose_criteria[static_cast<std::size_t>(options.criterion)];
}

// Thousandths of a degree or micrometres, unless that is beyond a limit.
double rounded(double value, const robotics::Joint& joint) {
  const double near = std::round(1e3 * value) * 1e-3;
  const bool is_beyond = joint.limits && (near < joint.limits->at(0) || near > joint.limits->at(1));
  return is_beyond ? value : near;
}

// Then the joint's own angle, and a part of what is before it, cannot be found.
bool is_on_last_axis(const robotics::Chain& chain) {
  const auto last = std::ssize(chain.joints) - 1;
  const Eigen::VectorXd any = Eigen::VectorXd::Zero(last + 1);
  constexpr double nothing_mm = 1e-6;
  return chain.joints[last].type == robotics::JointType::revolute &&
         robotics::Kinematics(chain).joint_jacobian(any).col(last).head(3).norm() < nothing_mm;
}

std::string use_words(const PoseFacts& facts) {
  if (!facts.use.empty()) return "over the poses of " + facts.face.table(facts.use);
  if (!facts.from.empty()) return "over the candidates";
  return !facts.options.box ? "over random poses within the joint limits" : "over random poses within limits and box";
}

std::string expectations(const robotics::PoseSelection& selection, bool with_indices, std::size_t width) {
  const robotics::Observability& chosen = selection.chosen.observability;
  const robotics::Observability& random = selection.random.observability;
  Table table({"expected after calibration", "chosen", "random"});
  const auto add = [&](const std::string& name, double with_chosen, double with_random) {
    table.add({name, number(with_chosen, 4), number(with_random, 4)});
  };
  add("error of the tool position, mm", selection.chosen.position_mm, selection.random.position_mm);
  if (!with_indices) return table.text(width);
  add("O1", chosen.o1, random.o1);
  add("O2", chosen.o2, random.o2);
  add("O3", chosen.o3, random.o3);
  add("O4", chosen.o4, random.o4);
  add("O5", chosen.o5, random.o5);
  add("condition", chosen.condition, random.condition);
  return table.text(width);
}

std::string expected_errors(const robotics::PoseSelection& selection, std::size_t width) {
  Table table({"parameter", "std error, chosen", "random", "unit"});
  for (std::size_t k = 0; k < selection.chosen.parameters.size(); ++k) {
    const robotics::PredictedCalibration::Parameter& parameter = selection.chosen.parameters[k];
    table.add({parameter.name, number(parameter.standard_error, 3),
               number(selection.random.parameters[k].standard_error, 3), parameter.unit});
  }
  return table.text(width);
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

}  // namespace

robotics::PoseCriterion pose_criterion(const std::string& name) {
  const auto place = std::ranges::find(pose_criteria, name);
  if (place == pose_criteria.end()) {
    throw std::invalid_argument(
        fmt::format("criterion: \"{}\" must be one of {}", name, fmt::join(pose_criteria, ", ")));
  }
  return static_cast<robotics::PoseCriterion>(place - pose_criteria.begin());
}

robotics::Robot robot_to_measure(robotics::Robot robot, const std::vector<double>& tool_mm) {
  if (!tool_mm.empty()) robot.chain.tool.xyz_mm = Eigen::Vector3d(tool_mm.data());
  robot.chain.bases.clear();
  robot.chain.tools.clear();
  return robot;
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

std::string poses_text(const PoseFacts& facts, std::size_t width) {
  const robotics::Robot& robot = facts.robot;
  const robotics::PosePlan& plan = facts.plan;
  const robotics::PoseSelectionOptions& options = facts.options;
  const robotics::PoseSelection& selection = facts.selection;
  const std::string with =
      plan.measured.count() > 0 ? fmt::format(" beside the {} measured ones", plan.measured.count()) : "";
  std::string text = fmt::format(
      "{}: {} poses chosen{} to identify {} parameters; criterion: {}\n\n", robot.chain.name, selection.poses.count(),
      with, selection.chosen.parameters.size(),
      options.criterion == robotics::PoseCriterion::position ? "error of the tool position" : criterion_name(options));
  const bool with_indices = options.criterion != robotics::PoseCriterion::position;
  text += expectations(selection, with_indices, width);
  text += fmt::format(
      "Error of the tool position: root mean square {}, for noise of {} um in each coordinate; the noise "
      "alone, no error of the model. {} get below {} mm. Random: the median of 25 draws.\n{}\n",
      use_words(facts), number(facts.noise_um),
      facts.from.empty() ? fmt::format("As far as the search sees, no {} poses", selection.poses.count())
                         : fmt::format("No {} of the candidates", selection.poses.count()),
      number(selection.bound_mm, 4),
      with_indices ? "O1 to O5: the larger the better; derivatives over the noise, parameters in units of 1 mm and 0.1 "
                     "deg (those of effects: their scales), the identifiable ones.\n"
                   : "");
  text += expected_errors(selection, width);
  std::vector<std::string> dependent;
  for (const robotics::FixedParameter& fixed : selection.fixed) {
    if (fixed.why != "fixed by the user") dependent.push_back(fixed.name);
  }
  text +=
      fmt::format("\nNot to be found from positions, or told apart from those above: {}\n", fmt::join(dependent, ", "));
  if (is_on_last_axis(robot.chain)) {
    text += fmt::format(
        "The measured point lies on the last axis, so {} does not move it. If the target is beside the "
        "axis, {} x,y,z says where.\n",
        robot.chain.joints.back().name, facts.face.option("tool"));
  }
  if (!selection.left_out.empty()) {
    text += fmt::format("Taken as known, because the poses lack the columns that they depend on: {}\n",
                        fmt::join(selection.left_out, ", "));
  }
  const bool has_slides = std::ranges::find(robot.chain.joints, robotics::JointType::prismatic,
                                            &robotics::Joint::type) != robot.chain.joints.end();
  text += fmt::format(
      "Order: from each pose to the nearest one; the largest joint moves add up to {} degrees{}. Collisions "
      "and the line of sight are not checked.\n",
      number(selection.travel_deg, 4),
      has_slides ? " (a slide counts by the angle at which its way is seen from as far as the machine reaches)" : "");
  return text;
}

Json poses_json(const PoseFacts& facts, const std::string& output) {
  const robotics::PoseSelection& selection = facts.selection;
  Json json = {{"robot", facts.robot_file},
               {"poses", selection.poses.count()},
               {"criterion", criterion_name(facts.options)},
               {"noise_um", facts.noise_um},
               {"seed", facts.options.seed},
               {"chosen", predicted_json(selection.chosen)},
               {"random", predicted_json(selection.random)},
               {"bound_mm", selection.bound_mm},
               {"travel_deg", selection.travel_deg},
               {"fixed", Json::array()},
               {"left_out", selection.left_out}};
  for (const robotics::FixedParameter& fixed : selection.fixed) {
    json["fixed"].push_back({{"name", fixed.name}, {"why", fixed.why}});
  }
  json["output"] = output.empty() ? Json(nullptr) : Json(output);
  return json;
}

}  // namespace llmt::report
