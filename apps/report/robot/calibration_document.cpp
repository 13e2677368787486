#include "report/robot/calibration_document.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "report/document/figures.hpp"
#include "report/robot/input_checks.hpp"
#include "report/robot/learning_figures.hpp"
#include "report/robot/measurement_text.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

using robotics::CalibrationReport;
using robotics::error_figures;
using robotics::ErrorFigures;
using robotics::Stage;

bool sees_distances(const robotics::Measurements& measurements) {
  const std::vector<robotics::Observation>& seen = measurements.poses.observations;
  return !seen.empty() && seen.front().reading == robotics::Reading::distance;
}

std::string kind_of(const robotics::Measurements& measurements) {
  return sees_distances(measurements) ? "distance" : "position";
}

// One kind of error, in-sample, held-out and on the test file.
Grid error_grid(const CalibrationRun& run, const std::string& head, const Eigen::VectorXd Stage::*in_sample,
                const Eigen::VectorXd Stage::*held_out, const std::optional<ErrorFigures> JudgedModel::*on_test) {
  const bool is_held_out = run.report.folds > 0;
  Grid grid{.header = {head, "mean", "95 %", "max"}, .rows = {}};
  if (is_held_out) grid.header.insert(grid.header.end(), {"| mean", "95 %", "max"});
  if (run.models.front().*on_test) grid.header.insert(grid.header.end(), {"| mean", "95 %", "max"});
  for (const JudgedModel& model : run.models) {
    std::vector<std::string> cells = {model.name};
    const auto add = [&](const ErrorFigures& figures) {
      for (const double value : {figures.mean, figures.p95, figures.max}) cells.push_back(fmt::format("{:.4f}", value));
    };
    add(error_figures(model.stage.*in_sample));
    if (is_held_out) add(error_figures(model.stage.*held_out));
    if (model.*on_test) add(*(model.*on_test));
    grid.rows.push_back(std::move(cells));
  }
  grid.marked = run.report.correction_kept ? 2 : 1;
  return grid;
}

// The length that stands for the scale where no reading shows it, or nothing.
std::string kept_length(const CalibrationReport& report) {
  for (const robotics::FixedParameter& fixed : report.calibration.fixed) {
    if (fixed.why == robotics::unseen_scale) return fixed.name;
  }
  return "";
}

Eigen::Index leaves_of(const Model& tree, Eigen::Index output) {
  Eigen::Index leaves = 0;
  for (const Partition& partition : tree.partitions()) {
    if (std::ranges::find(partition.outputs, output) != partition.outputs.end()) leaves += partition.num_leaves();
  }
  return leaves;
}

// "Leaves of the correction: dx_mm 12, dy_mm 8"
std::string size_sentence(const robotics::Correction& correction) {
  const auto* tree = std::get_if<Model>(&correction);
  const std::vector<OutputColumn>& outputs = robotics::outputs_of(correction);
  std::vector<std::string> sizes;
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    const Eigen::Index size = tree != nullptr ? leaves_of(*tree, static_cast<Eigen::Index>(k))
                                              : std::ssize(std::get<BoostedModel>(correction).sums()[k].trees);
    sizes.push_back(fmt::format("{} {}", outputs[k].name, size));
  }
  return fmt::format("{} of the correction: {}", tree != nullptr ? "Leaves" : "Trees", fmt::join(sizes, ", "));
}

// What the tables of errors are of, and what was decided by them.
std::vector<std::string> error_sentences(const CalibrationRun& run) {
  const CalibrationReport& report = run.report;
  std::vector<std::string> lines = {
      fmt::format("Positions are {}.", frames_text(report.calibration.robot.chain, run.measurements.poses)),
      "nominal: base and tool fitted to the poses, everything else as described."};
  if (report.folds > 0) {
    lines.push_back(
        fmt::format("held-out: on poses that were left out of the fit{}. in-sample: on the poses that were fitted.",
                    kept_length(report).empty() ? "; take these for the error at new poses" : ""));
  }
  const bool are_sweeps = report.folds > 0 && !robotics::sweeps_of(run.measurements.poses).empty();
  if (are_sweeps) lines.emplace_back("The poses move one joint at a time: whole sweeps are held out.");
  if (report.folds > 0 && !are_sweeps && !robotics::path_of(run.measurements.poses).empty()) {
    lines.emplace_back("The poses lie along a path: whole stretches of it are held out.");
  }
  if (report.correction) lines.push_back(size_sentence(*report.correction));
  if (!report.decision.empty()) lines.push_back(report.decision);
  if (!run.used || run.used->outside.empty()) return lines;
  std::vector<std::string> joints;
  for (const robotics::Beyond& range : run.used->beyond) {
    joints.push_back(fmt::format("{} {:.0f} to {:.0f} {} (measured {:.0f} to {:.0f})", range.name, range.used_low,
                                 range.used_high, range.unit, range.measured_low, range.measured_high));
  }
  lines.push_back(fmt::format(
      "{} test poses lie outside of what was measured: {}. There the parameters leave the tool uncertain by {:.4f} mm "
      "(one standard deviation; inside: {:.4f} mm), and errors of the arm that show only there are unknown.",
      run.used->outside.size(), fmt::join(joints, ", "), run.used->deviation_outside_mm,
      run.used->deviation_inside_mm));
  return lines;
}

std::vector<Json> error_blocks(const CalibrationRun& run) {
  Grid points = error_grid(run, kind_of(run.measurements) + " error, mm", &Stage::in_sample_mm, &Stage::held_out_mm,
                           &JudgedModel::test);
  points.title = "In-sample";
  if (run.report.folds > 0) {
    points.title += fmt::format(", then held-out ({} {} folds)", run.report.folds,
                                run.task.options.kind == FoldKind::contiguous ? "contiguous" : "random");
  }
  if (run.models.front().test) points.title += ", then on the test file";
  std::vector<Json> blocks = {block(points)};
  if (run.report.geometric.in_sample_mrad.size() > 0) {
    blocks.push_back(block(error_grid(run, "orientation error, mrad", &Stage::in_sample_mrad, &Stage::held_out_mrad,
                                      &JudgedModel::test_mrad)));
  }
  blocks.push_back(text_block("", error_sentences(run)));
  return blocks;
}

// As many decimals as show two digits of the standard error, at most six: lengths in mm and angles in degrees are never
// known better.
std::string to_error(double value, double error) {
  constexpr int most = 6;
  const bool is_known = std::isfinite(error) && error > 0.0;
  const int decimals = is_known ? std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, most) : most;
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  return text.find_first_not_of("-0.") == std::string::npos ? fmt::format("{:.{}f}", 0.0, decimals) : text;
}

Grid parameter_grid(const robotics::Robot& nominal, const CalibrationReport& report) {
  const std::vector<discovery::Parameter> before = robotics::parameters(nominal);
  const discovery::SolverResult& result = report.calibration.result;
  Grid grid{.header = {"parameter", "nominal", "identified", "change", "std error", "unit"}, .rows = {}, .wide = true};
  for (std::size_t k = 0; k < result.parameters.size(); ++k) {
    const discovery::Parameter& after = result.parameters[k];
    const auto nominal_value = std::ranges::find(before, after.name, &discovery::Parameter::name);
    if (!after.free || nominal_value == before.end()) continue;
    const double error = result.standard_errors(k);
    const bool is_geometric = after.unit == "mm" || after.unit == "deg";
    const auto shown = [&](double value, int digits) {
      return is_geometric ? to_error(value, error) : number(value, digits);
    };
    grid.rows.push_back({after.name, shown(nominal_value->value, 7), shown(after.value, 7),
                         shown(after.value - nominal_value->value, 4), std::isfinite(error) ? shown(error, 2) : "-",
                         after.unit});
  }
  return grid;
}

std::vector<std::string> parameter_sentences(const CalibrationRun& run) {
  const robotics::Calibration& calibration = run.report.calibration;
  const discovery::SolverResult& result = calibration.result;
  std::vector<std::string> lines = {
      result.converged()
          ? fmt::format("{} parameters identified; the fit converged after {} iterations", result.rank,
                        result.iterations)
          : fmt::format("{} parameters identified; the fit did NOT converge: {}", result.rank, result.reason)};
  if (calibration.began_without_priors) {
    lines.emplace_back(
        "The description is far off. Two starts were tried; the second one won, which began without the priors that "
        "hold parameters near it");
  }
  std::vector<std::string> kept;
  std::vector<std::string> dependent;
  std::vector<std::string> unseen;
  for (const robotics::FixedParameter& fixed : calibration.fixed) {
    (fixed.why == "fixed by the user"       ? kept
     : fixed.why == robotics::unseen_motion ? unseen
                                            : dependent)
        .push_back(fixed.name);
  }
  if (!dependent.empty()) {
    lines.push_back(fmt::format(
        "Not identified but kept as described, because they move the measured point as parameters above do, or not at "
        "all: {}",
        fmt::join(dependent, ", ")));
  }
  if (!unseen.empty()) {
    lines.push_back(fmt::format("Kept as described, because only the motion of joints that hardly moved could tell: {}",
                                fmt::join(unseen, ", ")));
  }
  if (!kept.empty()) {
    lines.push_back(fmt::format("Kept as described by {} or {}: {}", run.task.face.option("fix"),
                                run.task.face.option("only"), fmt::join(kept, ", ")));
  }
  if (const std::string uncertain = uncertain_text(calibration.robot); !uncertain.empty()) {
    lines.push_back(fmt::format(
        "Uncertain values: {}. These poses do not determine each of them alone, so do not take them for the true "
        "ones. Positions near these poses do not suffer: all values together give them.",
        uncertain));
  }
  for (const discovery::Combination& combination : result.unidentifiable) {
    lines.push_back(fmt::format("These poses determine only a combination of: {}", combination.names()));
  }
  return lines;
}

// The sentence to read if only one is read, where nothing looks wrong.
std::string verdict(const CalibrationRun& run) {
  const CalibrationReport& report = run.report;
  const bool is_held_out = report.folds > 0;
  const auto mean = [&](const Stage& stage) { return (is_held_out ? stage.held_out_mm : stage.in_sample_mm).mean(); };
  std::string text = fmt::format("Calibrated: the mean {} error falls from {:.4f} to {:.4f} mm",
                                 kind_of(run.measurements), mean(report.nominal), mean(report.geometric));
  if (report.correction_kept) {
    const double corrected = mean(*report.corrected);
    text += fmt::format(", and {}to {:.4f} mm with the correction",
                        corrected <= mean(report.geometric) ? "" : "rises again ", corrected);
  }
  return text + (is_held_out ? ", on poses left out of the fit."
                             : ", on the poses of the fit; none were left out to judge it.");
}

// What the errors are of if not of x, y and z, or nothing.
std::string missing_axes(const robotics::Measurements& measurements) {
  const std::vector<robotics::Observation>& observations = measurements.poses.observations;
  const std::string base = observations.empty() ? "" : observations.front().base;
  if (robotics::is_plane(base)) return "all errors are distances from the planes";
  if (robotics::is_sphere(base) || robotics::is_known_sphere(base)) {
    return "all errors are distances from the surfaces of the spheres";
  }
  if (sees_distances(measurements)) return "";
  std::vector<std::string> seen;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (measurements.measured[axis]) seen.emplace_back(1, "xyz"[axis]);
  }
  if (seen.size() == 3) return "";
  return fmt::format("only {} {} measured; all errors are of {}", fmt::join(seen, " and "),
                     seen.size() == 1 ? "was" : "were", seen.size() == 1 ? "it" : "these");
}

std::vector<std::string> notes_of(const CalibrationRun& run) {
  const robotics::Measurements& measurements = run.measurements;
  std::vector<std::string> lines;
  const auto note = [&](const std::string& text) {
    if (!text.empty()) lines.push_back("Note: " + text);
  };
  note(missing_axes(measurements));
  if (std::ranges::any_of(measurements.poses.observations, robotics::is_known_sphere, &robotics::Observation::base)) {
    note(
        "the radii in the file give the scale: 0.1 % of error there is 0.1 % of every position. The errors are scatter "
        "at spheres, not errors of positions elsewhere");
  }
  if (const std::string kept = kept_length(run.report); !kept.empty()) {
    note(fmt::format(
        "no reading shows the scale. All lengths are relative to {}, kept as described: 0.1 % of error there is 0.1 % "
        "of every position. The errors are scatter at what was touched, not errors of positions elsewhere",
        kept));
  }
  std::ranges::for_each(words(measurements.warnings, run.task.face), note);
  if (!run.report.calibration.still.empty()) note(still_text(run.report.calibration.still));
  if (!run.outlier_lines.empty()) {
    lines.push_back("Left out, more than four times as far off as the median: " +
                    run.task.face.rows(run.outlier_lines));
  }
  if (!measurements.unused_columns.empty()) {
    lines.push_back(fmt::format("Columns not used: {}", fmt::join(measurements.unused_columns, ", ")));
  }
  if (const std::string use = use_of_orientations(measurements, run.task.face); !use.empty()) lines.push_back(use);
  return lines;
}

std::vector<std::string> detail_sentences(const CalibrationDetails& details) {
  const robotics::Observability& seen = details.seen;
  std::vector<std::string> lines = {
      fmt::format("mean error with each pose left out in turn (to first order): {:.4f} mm", details.leave_one_out_mm)};
  if (details.repeats) {
    lines.push_back(fmt::format("noise of one coordinate by {} repeats: {:.4f} mm", details.repeats->freedom,
                                details.repeats->sigma_mm));
  }
  lines.push_back(fmt::format("observability: O1 {:.4g}, O2 {:.4g}, O3 {:.4g}, O4 {:.4g}, O5 {:.4g}; condition {:.4g}",
                              seen.o1, seen.o2, seen.o3, seen.o4, seen.o5, seen.condition));
  for (const CalibrationDetails::Correlation& pair : details.correlations) {
    lines.push_back(fmt::format("{} and {} are strongly correlated: {:.3f}", pair.first, pair.second, pair.value));
  }
  return lines;
}

// A terminal shows the curve where the details are asked for, a page always.
Section poses_section(const CalibrationRun& run) {
  Section section{"What the poses determine"};
  if (run.details) {
    section.blocks.push_back(
        text_block("How well these poses determine the parameters", detail_sentences(*run.details)));
  }
  if (!run.learning.empty()) {
    const Json chart = block(learning_chart(run.learning));
    section.blocks.push_back(run.details ? or_table(chart, learning_grid(run.learning)) : chart);
  }
  if (run.details && !run.details->shares.empty()) {
    std::vector<std::string> shares;
    for (const CalibrationDetails::Share& share : run.details->shares) {
      shares.push_back(fmt::format("{:<24}{:6.1f} %", share.of, 100.0 * share.share));
    }
    section.blocks.push_back(text_block("Of the mean square error of the described arm", shares));
  }
  return section;
}

}  // namespace

std::string subject_of(const CalibrationRun& run, const std::string& table) {
  return fmt::format("{}: {} of {}", table, counts_of(run.measurements), run.nominal.chain.name);
}

Document calibration_document(const CalibrationRun& run) {
  Document document{
      .title = fmt::format("llmt-robot calibrate {} {}", file_name(run.task.robot_file), file_name(run.task.data_file)),
      .subject = subject_of(run, run.task.face.table(run.task.data_file)),
      .answer = verdict(run)};
  document.notes = notes_of(run);
  if (!run.input_mistakes.empty()) {
    std::vector<std::string> mistakes = words(run.input_mistakes, run.task.face);
    for (std::string& mistake : mistakes) mistake.insert(0, "WARNING: ");
    document.answer = mistakes.front();
    document.notes.insert(document.notes.begin(), mistakes.begin() + 1, mistakes.end());
  }
  if (run.is_implausible) return document;  // no value means anything
  document.beside_main = error_blocks(run);
  document.sections = {{"What was identified",
                        "",
                        {block(parameter_grid(run.nominal, run.report)), text_block("", parameter_sentences(run))}},
                       poses_section(run)};
  return document;
}

}  // namespace llmt::report
