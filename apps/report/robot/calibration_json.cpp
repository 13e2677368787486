#include <cmath>

#include "report/robot/calibration_run.hpp"
#include "report/robot/input_checks.hpp"
#include "report/robot/measurement_text.hpp"
#include "report/robot/provenance.hpp"

namespace llmt::report {
namespace {

using robotics::error_figures;

Json details_json(const CalibrationDetails& details, const std::vector<robotics::LearningPoint>& learning) {
  const robotics::Observability& seen = details.seen;
  Json json;
  json["leave_one_out_mm"] = details.leave_one_out_mm;
  json["observability"] = {{"O1", seen.o1}, {"O2", seen.o2}, {"O3", seen.o3}, {"O4", seen.o4}, {"O5", seen.o5}};
  json["repeat_noise_mm"] = details.repeats ? Json(details.repeats->sigma_mm) : Json(nullptr);
  json["repeats"] = details.repeats ? details.repeats->freedom : 0;
  json["learning_curve"] = Json::array();
  for (const robotics::LearningPoint& point : learning) {
    json["learning_curve"].push_back(
        {{"poses", point.poses}, {"fitted_mm", point.fitted_mm}, {"held_out_mm", point.held_out_mm}});
  }
  json["correlations"] = Json::array();
  for (const CalibrationDetails::Correlation& pair : details.correlations) {
    json["correlations"].push_back({{"first", pair.first}, {"second", pair.second}, {"value", pair.value}});
  }
  for (const CalibrationDetails::Share& share : details.shares) json["shares"][share.of] = share.share;
  return json;
}

}  // namespace

Json figures_json(const robotics::ErrorFigures& figures) {
  return {{"mean", figures.mean}, {"p95", figures.p95}, {"max", figures.max}, {"rms", figures.rms}};
}

Json calibration_json(const CalibrationRun& run, const std::string& output) {
  const robotics::CalibrationReport& report = run.report;
  const robotics::Measurements& measurements = run.measurements;
  const discovery::SolverResult& result = report.calibration.result;
  Json json;
  json["robot"] = run.task.robot_file;
  json["data"] = run.task.data_file;
  json["poses"] = report.calibration.robot.calibration->poses;
  json["readings"] = measurements.count();
  json["folds"] = report.folds;
  json["contiguous"] = run.task.options.kind == FoldKind::contiguous;
  json["grouped_by_pose"] = report.grouped;
  if (!robotics::sweeps_of(measurements.poses).empty()) json["sweeps"] = true;
  if (!robotics::path_of(measurements.poses).empty()) json["path"] = true;
  for (const JudgedModel& row : run.models) {
    Json entry;
    entry["in_sample_mm"] = figures_json(error_figures(row.stage.in_sample_mm));
    entry["held_out_mm"] =
        row.stage.held_out_mm.size() > 0 ? figures_json(error_figures(row.stage.held_out_mm)) : Json(nullptr);
    if (row.test) entry["test_mm"] = figures_json(*row.test);
    if (row.stage.in_sample_mrad.size() > 0) {
      entry["in_sample_mrad"] = figures_json(error_figures(row.stage.in_sample_mrad));
    }
    if (row.stage.held_out_mrad.size() > 0) {
      entry["held_out_mrad"] = figures_json(error_figures(row.stage.held_out_mrad));
    }
    if (row.test_mrad) entry["test_mrad"] = figures_json(*row.test_mrad);
    json["errors"][row.name] = std::move(entry);
  }
  json["correction_kept"] = report.corrected ? Json(report.correction_kept) : Json(nullptr);
  json["decision"] = report.decision;
  if (run.acceptance.verdict != Acceptance::Verdict::not_asked) {
    const bool is_evaluated = run.acceptance.verdict != Acceptance::Verdict::not_evaluated;
    json["limit"] = {{"limit_mm", run.task.limit_mm},
                     {"verdict", to_string(run.acceptance.verdict)},
                     {"error_mm", is_evaluated ? Json(run.acceptance.error_mm) : Json(nullptr)}};
  }
  json["termination"] = discovery::to_string(result.termination);
  json["iterations"] = result.iterations;
  if (report.calibration.began_without_priors) json["began_without_priors"] = true;
  json["identified_parameters"] = result.rank;
  json["condition_number"] = result.condition_number;
  json["coordinate_noise_mm"] = report.calibration.noise_mm;
  if (report.calibration.orientation_noise_mrad > 0.0) {
    json["orientation_noise_mrad"] = report.calibration.orientation_noise_mrad;
  }
  json["parameters"] = Json::array();
  for (Eigen::Index k = 0; k < result.values.size(); ++k) {
    const discovery::Parameter& parameter = result.parameters[k];
    if (parameter.free) {
      json["parameters"].push_back(
          {{"name", parameter.name},
           {"unit", parameter.unit},
           {"value", parameter.value},
           {"standard_error",
            std::isfinite(result.standard_errors(k)) ? Json(result.standard_errors(k)) : Json(nullptr)}});
    }
  }
  json["fixed"] = Json::array();
  for (const robotics::FixedParameter& fixed : report.calibration.fixed) {
    json["fixed"].push_back({{"name", fixed.name}, {"why", fixed.why}});
  }
  if (!report.calibration.still.empty()) json["still_joints"] = still_json(report.calibration.still);
  json["weak"] = report.calibration.weak;
  json["uncertain"] = Json::array();
  for (const robotics::IdentifiedParameter& parameter : robotics::uncertain_parameters(report.calibration.robot)) {
    json["uncertain"].push_back(parameter.name);
  }
  std::vector<Finding> warnings = measurements.warnings;
  warnings.insert(warnings.end(), run.input_mistakes.begin(), run.input_mistakes.end());
  json["warnings"] = words(warnings, run.task.face);
  if (run.suspicion) json["suspicion"] = run.suspicion->name;
  json["outlier_lines"] = run.outlier_lines;
  if (run.used) {
    json["test_coverage"] = {{"outside", run.used->outside.size()},
                             {"deviation_inside_mm", run.used->deviation_inside_mm},
                             {"deviation_outside_mm", run.used->deviation_outside_mm}};
  }
  if (run.details) json["quality"] = details_json(*run.details, run.learning);
  if (const auto& made = report.calibration.robot.calibration->made_from) json["made_from"] = provenance_json(*made);
  json["frame"] = frames_text(report.calibration.robot.chain, measurements.poses);
  json["unused_columns"] = measurements.unused_columns;
  json["output"] = output.empty() ? Json(nullptr) : Json(output);
  return json;
}

}  // namespace llmt::report
