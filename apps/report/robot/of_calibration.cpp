#include "report/robot/of_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "llmt/random.hpp"
#include "report/document/figures.hpp"
#include "report/robot/arms.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

struct StageShown {
  std::string name;
  std::string role;
  Eigen::VectorXd distances_mm;
};

// On held-out poses where there are folds.
std::vector<StageShown> stages_of(const Calibrated& of) {
  const auto pick = [&](const robotics::Stage& stage) {
    return of.report.folds > 0 ? stage.held_out_mm : stage.in_sample_mm;
  };
  std::vector<StageShown> stages = {{"as described", "before", pick(of.report.nominal)},
                                    {"calibrated", "after", pick(of.report.geometric)}};
  if (of.report.corrected) {
    stages.push_back({of.report.correction_kept ? "with correction" : "with correction (left out)", "floor",
                      pick(*of.report.corrected)});
  }
  return stages;
}

// The mean distance that noise of the size of the residuals makes by itself: the mean of a chi distribution.
double noise_distance(const Calibrated& of) {
  const auto axes = std::ranges::count(of.measurements.measured, true);
  return of.report.calibration.noise_mm * (axes == 3 ? 1.5958 : axes == 2 ? 1.2533 : 0.7979);
}

std::string sentence(const Calibrated& of, const std::vector<StageShown>& stages) {
  std::string text = fmt::format("Calibration takes the mean position error from {} to {} mm",
                                 number(stages[0].distances_mm.mean(), 3), number(stages[1].distances_mm.mean(), 3));
  if (stages[1].distances_mm.mean() > 0.95 * stages[0].distances_mm.mean()) {
    text = fmt::format("Calibration hardly helps: the mean position error is {} mm, and was {} mm",
                       number(stages[1].distances_mm.mean(), 3), number(stages[0].distances_mm.mean(), 3));
  }
  if (of.report.corrected) {
    text += of.report.correction_kept
                ? fmt::format(", a learned correction to {} mm", number(stages[2].distances_mm.mean(), 3))
                : "; a learned correction does not help and is left out";
  }
  return text + (of.report.folds > 0 ? ", on poses that took no part." : ", on the poses that were fitted.");
}

Json figures_table(const Calibrated& of, const std::vector<StageShown>& stages) {
  Grid grid{.title = "In figures",
            .caption = of.report.folds > 0
                           ? fmt::format("Position error in mm on poses that took no part ({} folds).", of.report.folds)
                           : "Position error in mm on the poses that were fitted: it says little of other poses.",
            .header = {"model", "mean", "95 % below", "largest", "rms"},
            .rows = {}};
  for (const StageShown& stage : stages) {
    const robotics::ErrorFigures figures = robotics::error_figures(stage.distances_mm);
    grid.rows.push_back(
        {stage.name, number(figures.mean, 3), number(figures.p95, 3), number(figures.max, 3), number(figures.rms, 3)});
  }
  grid.marked = of.report.correction_kept && of.report.corrected ? 2 : 1;
  return block(grid);
}

std::vector<std::size_t> identified(const discovery::SolverResult& result) {
  std::vector<std::size_t> free;
  for (std::size_t k = 0; k < result.parameters.size(); ++k) {
    if (result.parameters[k].free && std::isfinite(result.standard_errors(k))) free.push_back(k);
  }
  return free;
}

Json parameter_table(const Calibrated& of) {
  const std::vector<discovery::Parameter> before = robotics::parameters(of.nominal);
  const discovery::SolverResult& result = of.report.calibration.result;
  Grid grid{
      .title = "Parameters",
      .caption =
          "Standard errors say how well these poses determine each parameter alone. Do not take uncertain values for "
          "the true ones; positions near these poses do not suffer.",
      .header = {"parameter", "described", "identified", "change", "std. error", "unit"},
      .rows = {},
      .wide = true};
  const auto uncertain = robotics::uncertain_parameters(of.report.calibration.robot);
  for (const std::size_t k : identified(result)) {
    const discovery::Parameter& after = result.parameters[k];
    const auto nominal = std::ranges::find(before, after.name, &discovery::Parameter::name);
    if (nominal == before.end()) continue;
    const bool is_uncertain =
        std::ranges::find(uncertain, after.name, &robotics::IdentifiedParameter::name) != uncertain.end();
    grid.rows.push_back({after.name + (is_uncertain ? " (uncertain)" : ""), number(nominal->value, 6),
                         number(after.value, 6), number(after.value - nominal->value, 3),
                         number(result.standard_errors(k), 2), after.unit});
  }
  return block(grid);
}

Json correlations(const discovery::SolverResult& result) {
  const std::vector<std::size_t> free = identified(result);
  const auto count = std::ssize(free);
  Map map{
      .title = "Correlations",
      .caption = "Near 1 or -1: these poses tell the sum or the difference of two parameters better than each of them.",
      .x = {},
      .y = {},
      .xs = {},
      .ys = {},
      .z = Eigen::MatrixXd(count, count),
      .unit = "correlation",
      .diverging = true,
      .limit = 1.0,
      .cells = count < 40,
      .reversed = true};
  for (Eigen::Index i = 0; i < count; ++i) {
    map.xs.push_back(static_cast<double>(i));
    map.ys.push_back(static_cast<double>(i));
    map.x.categories.push_back(result.parameters[free[i]].name);
    for (Eigen::Index j = 0; j < count; ++j) {
      map.z(i, j) =
          result.covariance(free[i], free[j]) / (result.standard_errors(free[i]) * result.standard_errors(free[j]));
    }
  }
  map.y.categories = map.x.categories;
  return block(map);
}

// The error on a fifth of the poses of calibrations to ever more of the others.
std::optional<Chart> learning_curve(const Calibrated& of) {
  const Eigen::Index count = of.measurements.count();
  if (count < 30) return {};
  std::vector<Eigen::Index> order(count);
  std::iota(order.begin(), order.end(), 0);
  Random random(of.options.seed);
  for (Eigen::Index k = count - 1; k > 0; --k) std::swap(order[k], order[random.below(k + 1)]);
  const Eigen::Index set_aside = count / 5;
  const robotics::Measurements test = robotics::select(of.measurements, {order.begin(), order.begin() + set_aside});
  Layer line{.mark = Mark::line, .name = "poses that took no part", .role = "after"};
  Layer fitted{.mark = Mark::line, .name = "poses that were fitted", .role = "before", .dashed = true};
  const Eigen::Index most = std::min<Eigen::Index>(count - set_aside, 2000);
  constexpr int points = 8;
  for (int k = 0; k < points; ++k) {
    const auto size =
        static_cast<Eigen::Index>(std::lround(12.0 * std::pow(static_cast<double>(most) / 12.0, k / (points - 1.0))));
    const robotics::Measurements train =
        robotics::select(of.measurements, {order.begin() + set_aside, order.begin() + set_aside + size});
    const robotics::Calibration calibration = robotics::calibrate(of.nominal, train, of.options.calibration);
    const auto add = [&](Layer& layer, const robotics::Measurements& on) {
      layer.x.push_back(static_cast<double>(size));
      layer.y.push_back(robotics::distances(robotics::positions(calibration.robot, on.poses), on).mean());
    };
    add(line, test);
    add(fitted, train);
  }
  return Chart{.title = "Are there enough poses?",
               .caption =
                   "Mean error of the calibrated robot. Where both lines have met, more poses of this kind will not "
                   "lower it: what is left is noise or not geometry.",
               .x = {"poses used for calibration", true},
               .y = {"mean position error, mm", true},
               .layers = {line, fitted}};
}

Chart left_along_joint(const Calibrated& of, const Eigen::MatrixXd& errors, Eigen::Index joint) {
  constexpr Eigen::Index most_shown = 1200;
  const robotics::Robot& robot = of.report.calibration.robot;
  const Numbers angles = joint_values(robot.chain, of.measurements.poses.joints, joint);
  const Eigen::VectorXd along = along_joint(robot, of.measurements, errors, joint);
  Layer points{.role = "after"};
  for (const Eigen::Index row : thinned(of.measurements.count(), most_shown)) {
    points.x.push_back(angles[row]);
    points.y.push_back(along(row));
  }
  return {.title = fmt::format("Along the motion of {}", robot.chain.joints[joint].name),
          .x = {joint_axis(robot.chain, joint)},
          .y = {"measured - model, mm"},
          .layers = {points},
          .references = {{false, 0.0, "", "floor"}}};
}

}  // namespace

Document calibration_report(const Calibrated& of) {
  const std::vector<StageShown> stages = stages_of(of);
  Document document{.title = fmt::format("llmt-robot calibrate {} {}", file_name(of.robot), file_name(of.data)),
                    .answer = sentence(of, stages)};
  document.lead = fmt::format("{} poses of {}; {} parameters identified.", of.measurements.count(),
                              of.nominal.chain.name, of.report.calibration.result.rank);
  if (!of.report.calibration.result.converged()) document.lead += " The calibration did not converge: do not use it.";
  for (const std::string& suspicion : of.suspicions) document.lead += " WARNING: " + suspicion;
  std::vector<Sample> samples;
  std::vector<std::pair<std::string, Eigen::VectorXd>> per_pose;
  std::vector<std::string> roles;
  for (const StageShown& stage : stages) {
    samples.push_back({stage.name, stage.role, numbers_of(stage.distances_mm)});
    per_pose.emplace_back(stage.name, stage.distances_mm);
    roles.push_back(stage.role);
  }
  document.main = shares_below("Share of the poses with an error below", "position error, mm", samples);
  document.main->caption = fmt::format(
      "The further to the left, the better. {}",
      of.report.folds > 0 ? "Each pose is judged by a calibration that had not seen it." : "These poses were fitted.");
  const Eigen::MatrixXd before =
      errors_at(robotics::positions(of.report.calibration.registered, of.measurements.poses), of.measurements);
  const Eigen::MatrixXd after =
      errors_at(robotics::positions(of.report.best(), of.measurements.poses), of.measurements);
  const double scale = arrow_scale(before, of.measurements);
  document.beside_main = {figures_table(of, stages)};
  Section size{"Where the robot is off, and how far"};
  size.blocks = {block(arm_picture("Before: as described", of.report.calibration.registered, of.measurements, before,
                                   scale, "before")),
                 block(arm_picture("After", of.report.calibration.robot, of.measurements, after, scale, "after"))};
  if (!of.report.decision.empty()) size.text = "Decision: " + of.report.decision + ".";
  size.blocks.push_back(block(error_per_pose(per_pose, roles)));
  samples.erase(samples.begin());
  Chart errors = histogram("After calibration", "position error, mm", samples);
  errors.caption = fmt::format(
      "The residuals scatter by {} mm a coordinate; pure noise of that size would make {} mm on average. {}",
      number(of.report.calibration.noise_mm, 2), number(noise_distance(of), 2), errors.caption);
  errors.references = {{true, noise_distance(of), "mean if all were noise"}};
  size.blocks.push_back(block(errors));
  if (const auto curve = learning_curve(of)) size.blocks.push_back(block(*curve));
  document.sections.push_back(std::move(size));
  Section left{"What geometry leaves",
               "The part of each error along the motion of one joint, over that joint. A pattern is an effect that the "
               "geometry lacks: llmt-robot discover names it."};
  const Eigen::MatrixXd of_geometry =
      errors_at(robotics::positions(of.report.calibration.robot, of.measurements.poses), of.measurements);
  for (Eigen::Index j = 0; j < std::min<Eigen::Index>(8, of.measurements.poses.joints.cols()); ++j)
    left.blocks.push_back(block(left_along_joint(of, of_geometry, j)));
  document.sections.push_back(std::move(left));
  document.sections.push_back(
      {"What was measured",
       "",
       {block(coverage(of.nominal.chain, of.measurements.poses.joints)), correlations(of.report.calibration.result)}});
  document.sections.push_back({"What was identified", "", {parameter_table(of)}});
  return document;
}

}  // namespace llmt::report
