#include "report/robot/of_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "report/document/figures.hpp"
#include "report/robot/arms.hpp"
#include "report/robot/calibration_document.hpp"
#include "report/robot/measurement_text.hpp"
#include "report/robot/provenance.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

// The mean distance that noise of the size of the residuals makes by itself: the mean of a chi distribution.
double noise_distance(const CalibrationRun& of) {
  const auto axes = std::ranges::count(of.measurements.measured, true);
  return of.report.calibration.noise_mm * (axes == 3 ? 1.5958 : axes == 2 ? 1.2533 : 0.7979);
}

std::vector<std::size_t> identified(const discovery::SolverResult& result) {
  std::vector<std::size_t> free;
  for (std::size_t k = 0; k < result.parameters.size(); ++k) {
    if (result.parameters[k].free && std::isfinite(result.standard_errors(k))) free.push_back(k);
  }
  return free;
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

Chart left_along_joint(const robotics::Robot& robot, const robotics::Measurements& measured,
                       const Eigen::MatrixXd& errors, Eigen::Index joint) {
  constexpr Eigen::Index most_shown = 1200;
  const Numbers angles = joint_values(robot.chain, measured.poses.joints, joint);
  const Eigen::VectorXd along = along_joint(robot, measured, errors, joint);
  Layer points{.role = "after"};
  for (const Eigen::Index row : thinned(measured.count(), most_shown)) {
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

Document calibration_page(const CalibrationRun& of) {
  const robotics::Measurements points = points_of(of.measurements);
  const bool is_held_out = of.report.folds > 0;
  std::vector<Sample> samples;
  std::vector<std::pair<std::string, Eigen::VectorXd>> per_pose;
  std::vector<std::string> roles;
  for (const JudgedModel& model : of.models) {
    const Eigen::VectorXd& errors = is_held_out ? model.stage.held_out_mm : model.stage.in_sample_mm;
    roles.emplace_back(std::array{"before", "after", "floor"}.at(roles.size()));
    samples.push_back({model.name, roles.back(), numbers_of(errors)});
    per_pose.emplace_back(model.name, errors);
  }
  Document document = calibration_document(of);
  document.subject = subject_of(of, file_name(of.task.face.table(of.task.data_file)));
  document.main = shares_below("Share of the poses with an error below", "position error, mm", samples);
  document.main->caption = fmt::format(
      "The further to the left, the better. {}",
      is_held_out ? "Each pose is judged by a calibration that had not seen it." : "These poses were fitted.");
  const robotics::Robot& calibrated = of.report.calibration.robot;
  const robotics::Robot& registered = of.report.calibration.registered;
  const auto errors_of = [&](const auto& robot) { return errors_at(robotics::positions(robot, points.poses), points); };
  const Eigen::MatrixXd before = errors_of(registered);
  const double scale = arrow_scale(before, points);
  Section size{"Where the robot is off, and how far"};
  size.blocks = {block(arm_picture("Before: as described", registered, points, before, scale, "before")),
                 block(arm_picture("After", calibrated, points, errors_of(of.report.best()), scale, "after")),
                 block(error_per_pose(per_pose, roles))};
  samples.erase(samples.begin());
  Chart errors = histogram("After calibration", "position error, mm", samples);
  errors.caption = fmt::format(
      "The residuals scatter by {} mm a coordinate; pure noise of that size would make {} mm on average. {}",
      number(of.report.calibration.noise_mm, 2), number(noise_distance(of), 2), errors.caption);
  errors.references = {{true, noise_distance(of), "mean if all were noise"}};
  size.blocks.push_back(block(errors));
  Section left{"What geometry leaves",
               "The part of each error along the motion of one joint, over that joint. A pattern is an effect that the "
               "geometry lacks: llmt-robot discover names it."};
  const Eigen::MatrixXd of_geometry = errors_of(calibrated);
  for (Eigen::Index j = 0; j < std::min<Eigen::Index>(8, points.poses.joints.cols()); ++j) {
    left.blocks.push_back(block(left_along_joint(calibrated, points, of_geometry, j)));
  }
  const Section measured{
      "What was measured",
      "",
      {block(coverage(of.nominal.chain, points.poses.joints)), correlations(of.report.calibration.result)}};
  document.sections.insert(document.sections.begin(), {size, left, measured});
  for (Section& section : provenance_section(calibrated)) document.sections.push_back(std::move(section));
  return document;
}

}  // namespace llmt::report
