#include "robot/of_paper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "report/document/figures.hpp"
#include "report/robot/arms.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

using namespace report;

// A value at every pose of the test grid as a map over the two joints.
Map over_joints(const PlanarFigures& figures, const Eigen::VectorXd& values, const std::string& title,
                const std::string& caption) {
  const Eigen::Index count = figures.joints.rows();
  Eigen::Index columns = 1;  // of the second joint, which is the fastest
  while (columns < count && figures.joints(columns, 0) == figures.joints(0, 0)) ++columns;
  Map map{.title = title,
          .caption = caption,
          .x = {"phi12, deg"},
          .y = {"phi23, deg"},
          .xs = {},
          .ys = {},
          .z = values.reshaped(columns, count / columns),
          .unit = "mm"};
  constexpr double degrees = 180.0 / std::numbers::pi;
  for (Eigen::Index k = 0; k < columns; ++k) map.ys.push_back(degrees * figures.joints(k, 1));
  for (Eigen::Index k = 0; k < count; k += columns) map.xs.push_back(degrees * figures.joints(k, 0));
  return map;
}

// Errors of one axis, and the trees of them, on one scale of colours.
void add_axis(const PlanarFigures& figures, int axis, Section& section) {
  const char* const name = axis == 0 ? "e_x" : "e_y";
  const double limit = figures.error.col(axis).cwiseAbs().maxCoeff();
  Map error = over_joints(figures, figures.error.col(axis), fmt::format("Figure {}: position error {}", 4 + axis, name),
                          "What calibration leaves.");
  Map trees =
      over_joints(figures, figures.correction.col(axis), fmt::format("Figure {}: the trees of {}", 6 + axis, name),
                  fmt::format("{} local linear models.", axis == 0 ? 93 : 75));
  for (Map* map : {&error, &trees}) {
    map->diverging = true;
    map->limit = limit;
    section.blocks.push_back(block(*map));
  }
}

const StudyRow& row_of(const std::vector<StudyRow>& rows, const std::string& name) {
  return *std::ranges::find(rows, name, &StudyRow::model);
}

std::vector<const StudyRow*> shown_rows(const PlanarStudy& study) {
  return {&row_of(study.arm, "rigid"), &row_of(study.arm, "calibrated"),
          &row_of(study.arm, "corrected, the paper's leaf counts"),
          &row_of(study.arm, "blend, the paper's leaf counts"), &study.black_box.front()};
}

Chart errors_chart(const PlanarStudy& study) {
  Chart chart{
      .title = "Error of the models of the planar arm",
      .caption =
          "Mean total error over 5985 test poses. Of the arm's models only ratios can be compared: the paper does "
          "not print its bending model.",
      .x = {},
      .y = {"mean total error, mm", true},
      .layers = {}};
  Layer ours{.mark = Mark::bars, .name = "here", .role = "after"};
  Layer paper{.mark = Mark::bars, .name = "printed in the paper", .role = "muted"};
  for (const StudyRow* row : shown_rows(study)) {
    const auto place = static_cast<double>(chart.x.categories.size());
    chart.x.categories.push_back(row->model == "corrected, the paper's leaf counts" ? "corrected by trees"
                                 : row->model == "blend, the paper's leaf counts"   ? "by blended trees"
                                 : row->model == "black box"                        ? "trees alone"
                                                                                    : row->model);
    ours.x.push_back(place);
    ours.y.push_back(row->error.mean);
    if (!row->paper) continue;
    paper.x.push_back(place);
    paper.y.push_back(row->paper->mean);
  }
  chart.layers = {ours, paper};
  return chart;
}

Json study_table(const PlanarStudy& study) {
  Grid grid{.title = "Table 1",
            .caption = study.carry_over ? "Link bending with moment and slope carried over to the next link."
                                        : "Link bending without carry-over.",
            .header = {"model", "poses", "leaves x + y", "mean, mm", "max, mm", "paper: mean", "max"},
            .rows = {},
            .wide = true};
  std::vector<StudyRow> rows = study.arm;
  rows.insert(rows.end(), study.black_box.begin(), study.black_box.end());
  for (const StudyRow& row : rows) {
    grid.rows.push_back({row.model, row.training_poses > 0 ? std::to_string(row.training_poses) : "-",
                         row.leaves.empty() ? "-" : fmt::format("{} + {}", row.leaves[0], row.leaves[1]),
                         number(row.error.mean, 3), number(row.error.max, 3),
                         row.paper ? number(row.paper->mean, 3) : "-", row.paper ? number(row.paper->max, 3) : "-"});
  }
  return block(grid);
}

Section simulated_arm(const Tx200Run& run) {
  const robotics::Measurements& measured = run.measurements;
  const robotics::Calibration& calibration = run.report.calibration;
  const Eigen::MatrixXd error = errors_at(robotics::positions(calibration.robot, measured.poses), measured);
  Chart in_sample = error_per_pose(
      {{"calibrated", run.report.geometric.in_sample_mm}, {"with trees", run.report.corrected->in_sample_mm}},
      {"before", "after"});
  in_sample.title = "Figure 13, as in the paper: the poses that were fitted";
  in_sample.caption = "Simulated. The trees seem to remove most of the error.";
  Chart held_out = error_per_pose(
      {{"calibrated", run.report.geometric.held_out_mm}, {"with trees", run.report.corrected->held_out_mm}},
      {"before", "after"});
  held_out.title = "The same on poses that took no part";
  held_out.caption = "Simulated; each pose is judged by a fit to the other 44. This is what the correction is worth.";
  in_sample.wide = false;
  held_out.wide = false;
  Section section{
      "A TX200-like arm, simulated",
      "45 poses with 10 um of noise; the compliance of axes 2 and 3 is hidden in the data. The paper measured a "
      "real arm; its data are not public, so these are simulated."};
  section.blocks = {block(arm_picture("Figure 12, simulated: measured points and scaled errors", calibration.robot,
                                      measured, error, arrow_scale(error, measured), "before")),
                    block(coverage(calibration.robot.chain, measured.poses.joints)), block(in_sample), block(held_out)};
  return section;
}

}  // namespace

report::Document planar_report(const std::vector<PlanarStudy>& studies, const Tx200Run& simulated) {
  const PlanarStudy& study = studies.front();
  const PlanarFigures& figures = study.figures;
  const double calibrated = row_of(study.arm, "calibrated").error.mean;
  const double corrected = row_of(study.arm, "corrected, the paper's leaf counts").error.mean;
  Document document{
      .title = "llmt-robot paper",
      .answer =
          fmt::format("Trees on top of a calibrated model leave {} % of its error, {} mm instead of {} mm; trees alone "
                      "are off by {} mm.",
                      number(100.0 * corrected / calibrated, 3), number(corrected, 3), number(calibrated, 3),
                      number(study.black_box.front().error.mean, 3))};
  document.lead =
      "The flexible planar arm of Benes et al. 2022 (doi 10.17973/MMSJ.2022_12_2022160), made new from its "
      "description. The "
      "paper: 0.0157 mm instead of 0.447 mm, 3.5 %; trees alone 7.88 mm.";
  document.main = errors_chart(study);
  document.beside_main = {
      block(over_joints(figures, row_of(study.arm, "corrected, the paper's leaf counts").total_mm,
                        "Figure 10: with trees", "Total error over the workspace, on a scale of its own."))};
  Section axes{"Figures 4 to 7: what calibration leaves, and the trees of it",
               "Beside each other on one scale of colours: the trees should look like the error."};
  for (const int axis : {0, 1}) add_axis(figures, axis, axes);
  Section alone{"Figures 8 and 9: the position by trees alone",
                "No model of the arm: 211 and 209 local linear models."};
  for (const int axis : {0, 1}) {
    alone.blocks.push_back(
        block(over_joints(figures, figures.black_box.col(axis),
                          fmt::format("Figure {}: position {}_C", 8 + axis, axis == 0 ? "X" : "Y"), "")));
  }
  Section totals{"Figure 10: the total error of every model",
                 "Each on a scale of its own: look at the numbers beside the colours."};
  for (const StudyRow* row : shown_rows(study)) {
    totals.blocks.push_back(block(
        over_joints(figures, row->total_mm, row->model,
                    fmt::format("Mean {} mm, largest {} mm.", number(row->error.mean, 3), number(row->error.max, 3)))));
  }
  document.sections = {axes, alone, totals, simulated_arm(simulated)};
  Section tables{"Table 1"};
  for (const PlanarStudy& each : studies) tables.blocks.push_back(study_table(each));
  document.sections.push_back(std::move(tables));
  return document;
}

report::Document tx200_report(const std::vector<Tx200Trial>& trials, const Tx200Run& first, std::uint64_t first_seed) {
  Layer in_sample{.name = "poses that were fitted", .role = "before"};
  Layer held_out{.name = "poses that took no part", .role = "after"};
  double gain = 0.0;
  double seeming = 0.0;
  double largest = 0.0;
  for (const Tx200Trial& trial : trials) {
    in_sample.x.push_back(trial.geometric_in_sample);
    in_sample.y.push_back(trial.corrected_in_sample);
    held_out.x.push_back(trial.geometric_held_out);
    held_out.y.push_back(trial.corrected_held_out);
    gain += trial.corrected_held_out / trial.geometric_held_out / static_cast<double>(trials.size());
    seeming += trial.corrected_in_sample / trial.geometric_in_sample / static_cast<double>(trials.size());
    largest = std::max({largest, trial.geometric_held_out, trial.geometric_in_sample});
  }
  Document document{
      .title = "llmt-robot paper --study tx200",
      .answer = fmt::format("On the 45 poses that were fitted trees leave {} of the error, on other poses {} of it.",
                            number(seeming, 3), number(gain, 3))};
  document.lead = fmt::format("{} simulated data sets, seeds from {}. Above 1 a correction makes the robot worse.",
                              trials.size(), first_seed);
  document.main = Chart{
      .title = "Every simulated data set",
      .caption = "Below the line the correction helps.",
      .x = {"mean error, calibrated, mm"},
      .y = {"mean error with trees, mm"},
      .layers = {in_sample,
                 held_out,
                 {.mark = Mark::line, .name = "no change", .role = "floor", .x = {0.0, largest}, .y = {0.0, largest}}}};
  document.sections = {simulated_arm(first)};
  return document;
}

}  // namespace llmt::apps
