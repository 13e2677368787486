#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "report/of_calibration.hpp"
#include "report/options.hpp"
#include "robot/commands.hpp"
#include "robot/corrected_file.hpp"
#include "robot/measured_file.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

using robotics::CalibrationReport;
using robotics::error_figures;
using robotics::ErrorFigures;

struct CalibrateArguments {
  std::string robot;
  robotics::UrdfLinks links;
  std::string data;
  std::string output;
  std::string test;
  bool contiguous = false;
  bool json = false;
  MeasuredFileOptions reading;
  robotics::ReportOptions options;
  ReportFiles reports;
};

struct Row {
  std::string name;
  const robotics::Stage* stage;
  std::optional<ErrorFigures> test = {};
  std::optional<ErrorFigures> test_mrad = {};
};

// Figures on measurements that took no part in anything.
void judge(Row& row, const robotics::CorrectedRobot& robot, const robotics::Measurements& test) {
  const Eigen::VectorXd errors = robotics::distances(robotics::positions(robot, test.poses), test);
  const std::vector<Eigen::Index> points = robotics::position_rows(test.poses);
  const std::vector<Eigen::Index> turns = robotics::orientation_rows(test.poses);
  row.test = error_figures(errors(points));
  if (!turns.empty()) {
    row.test_mrad = error_figures(1e3 / test.poses.observations[turns.front()].lever_mm * errors(turns));
  }
}

std::vector<Row> rows_of(const CalibrationReport& report, const std::optional<robotics::Measurements>& test) {
  std::vector<Row> rows = {{"nominal", &report.nominal}, {"geometric", &report.geometric}};
  if (report.corrected) rows.push_back({"corrected", &*report.corrected});
  if (test) {
    judge(rows[0], {report.calibration.registered, std::nullopt}, *test);
    judge(rows[1], {report.calibration.robot, std::nullopt}, *test);
    if (report.corrected) judge(rows[2], {report.calibration.robot, report.correction->model}, *test);
  }
  return rows;
}

Json figures_json(const ErrorFigures& figures) {
  return {{"mean", figures.mean}, {"p95", figures.p95}, {"max", figures.max}, {"rms", figures.rms}};
}

Json report_json(const CalibrateArguments& arguments, const robotics::Measurements& measurements,
                 const CalibrationReport& report, const std::vector<Row>& rows) {
  const discovery::SolverResult& result = report.calibration.result;
  Json json;
  json["robot"] = arguments.robot;
  json["data"] = arguments.data;
  json["poses"] = measurements.count();
  json["folds"] = report.folds;
  json["contiguous"] = arguments.contiguous;
  json["grouped_by_pose"] = report.grouped;
  for (const Row& row : rows) {
    Json entry;
    entry["in_sample_mm"] = figures_json(error_figures(row.stage->in_sample_mm));
    entry["held_out_mm"] =
        row.stage->held_out_mm.size() > 0 ? figures_json(error_figures(row.stage->held_out_mm)) : Json(nullptr);
    if (row.test) entry["test_mm"] = figures_json(*row.test);
    if (row.stage->in_sample_mrad.size() > 0) {
      entry["in_sample_mrad"] = figures_json(error_figures(row.stage->in_sample_mrad));
    }
    if (row.stage->held_out_mrad.size() > 0) {
      entry["held_out_mrad"] = figures_json(error_figures(row.stage->held_out_mrad));
    }
    if (row.test_mrad) entry["test_mrad"] = figures_json(*row.test_mrad);
    json["errors"][row.name] = std::move(entry);
  }
  json["correction_kept"] = report.corrected ? Json(report.correction_kept) : Json(nullptr);
  json["decision"] = report.decision;
  json["termination"] = discovery::to_string(result.termination);
  json["iterations"] = result.iterations;
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
  json["weak"] = report.calibration.weak;
  json["warnings"] = measurements.warnings;
  json["unused_columns"] = measurements.unused_columns;
  json["output"] = arguments.output.empty() ? Json(nullptr) : Json(arguments.output);
  return json;
}

// One kind of error, in-sample, held-out and on the test file.
std::string error_table(const std::vector<Row>& rows, const std::string& head, bool is_held_out,
                        const Eigen::VectorXd robotics::Stage::*in_sample,
                        const Eigen::VectorXd robotics::Stage::*held_out,
                        const std::optional<ErrorFigures> Row::*on_test) {
  std::vector<std::string> header = {head, "mean", "95 %", "max"};
  if (is_held_out) header.insert(header.end(), {"| mean", "95 %", "max"});
  if (rows.front().*on_test) header.insert(header.end(), {"| mean", "95 %", "max"});
  Table table(header);
  for (const Row& row : rows) {
    std::vector<std::string> cells = {row.name};
    const auto add = [&](const ErrorFigures& figures) {
      for (const double value : {figures.mean, figures.p95, figures.max}) cells.push_back(fmt::format("{:.4f}", value));
    };
    add(error_figures(row.stage->*in_sample));
    if (is_held_out) add(error_figures(row.stage->*held_out));
    if (row.*on_test) add(*(row.*on_test));
    table.add(std::move(cells));
  }
  return table.text();
}

std::string error_tables(const std::vector<Row>& rows, const CalibrationReport& report, bool contiguous) {
  using robotics::Stage;
  const bool is_held_out = report.folds > 0;
  std::string text = "in-sample";
  if (is_held_out)
    text += fmt::format(", then held-out ({} {} folds)", report.folds, contiguous ? "contiguous" : "random");
  if (rows.front().test) text += ", then on the test file";
  text += ":\n" +
          error_table(rows, "position error, mm", is_held_out, &Stage::in_sample_mm, &Stage::held_out_mm, &Row::test);
  if (report.geometric.in_sample_mrad.size() == 0) return text;
  return text + error_table(rows, "orientation error, mrad", is_held_out, &Stage::in_sample_mrad, &Stage::held_out_mrad,
                            &Row::test_mrad);
}

std::string parameter_table(const robotics::Robot& nominal, const CalibrationReport& report) {
  const std::vector<discovery::Parameter> before = robotics::parameters(nominal);
  const discovery::SolverResult& result = report.calibration.result;
  Table table({"parameter", "nominal", "identified", "change", "std error", "unit"});
  for (std::size_t k = 0; k < result.parameters.size(); ++k) {
    const discovery::Parameter& after = result.parameters[k];
    const auto nominal_value = std::ranges::find(before, after.name, &discovery::Parameter::name);
    if (after.free && nominal_value != before.end()) {
      const double error = result.standard_errors(k);
      table.add({after.name, number(nominal_value->value, 7), number(after.value, 7),
                 number(after.value - nominal_value->value, 4), std::isfinite(error) ? number(error, 2) : "-",
                 after.unit});
    }
  }
  return table.text();
}

void print_report(const CalibrateArguments& arguments, const robotics::Robot& nominal,
                  const robotics::Measurements& measurements, const CalibrationReport& report,
                  const std::vector<Row>& rows, const std::vector<std::string>& suspicions) {
  const discovery::SolverResult& result = report.calibration.result;
  print(fmt::format("{}: {} of {}\n", arguments.data, counts_of(measurements), nominal.chain.name));
  for (const std::string& warning : measurements.warnings) {
    print("Note: " + warning + "\n");
  }
  if (!measurements.unused_columns.empty()) {
    print(fmt::format("Columns not used: {}\n", fmt::join(measurements.unused_columns, ", ")));
  }
  print(use_of_orientations(measurements));
  print(fmt::format("\n{}\n", parameter_table(nominal, report)));
  print(result.converged()
            ? fmt::format("{} parameters identified; the fit converged after {} iterations\n", result.rank,
                          result.iterations)
            : fmt::format("{} parameters identified; the fit did NOT converge: {}\n", result.rank, result.reason));
  std::vector<std::string> kept;
  std::vector<std::string> dependent;
  for (const robotics::FixedParameter& fixed : report.calibration.fixed) {
    (fixed.why == "fixed by the user" ? kept : dependent).push_back(fixed.name);
  }
  if (!dependent.empty()) {
    print(fmt::format(
        "Left as described, because they move the measured point as parameters above do, or not at all: {}\n",
        fmt::join(dependent, ", ")));
  }
  if (!kept.empty()) print(fmt::format("Left as described by --fix or --only: {}\n", fmt::join(kept, ", ")));
  if (!report.calibration.weak.empty()) {
    print(
        fmt::format("These poses hardly determine the following, which stay close to the description; positions near "
                    "these poses do not suffer: {}\n",
                    fmt::join(report.calibration.weak, ", ")));
  }
  for (const discovery::Combination& combination : result.unidentifiable) {
    print(fmt::format("These poses determine only a combination of: {}\n", combination.names()));
  }
  print("\n" + error_tables(rows, report, arguments.contiguous));
  print("nominal: base and tool fitted to the poses, everything else as described.\n");
  if (report.correction) {
    std::vector<std::string> leaves;
    for (const PartitionSummary& partition : report.correction->summary.partitions) {
      for (const int output : partition.outputs) {
        leaves.push_back(fmt::format("{} {}", report.correction->model.outputs()[output].name, partition.leaves));
      }
    }
    print(fmt::format("Leaves of the correction: {}\n", fmt::join(leaves, ", ")));
  }
  if (!report.decision.empty()) {
    print(report.decision + "\n");
  }
  for (const std::string& suspicion : suspicions) {
    print("WARNING: " + suspicion + "\n");
  }
}

void calibrate_command(CalibrateArguments arguments) {
  const robotics::Robot described = read_description(arguments.robot, arguments.data, arguments.links);
  refuse_lost_correction(described, arguments.robot, arguments.output);
  robotics::Measurements measurements = read_measured(arguments.data, described, {}, arguments.reading);
  const robotics::Robot nominal = robotics::with_frames(described, measurements.poses);
  if (measurements.count() < arguments.options.folds) {
    throw std::runtime_error(fmt::format("{}: {} poses do not make {} folds", arguments.data, measurements.count(),
                                         arguments.options.folds));
  }
  std::optional<robotics::Measurements> test;
  if (!arguments.test.empty()) {
    test = read_measured(arguments.test, described, {}, arguments.reading);
    check_positions(arguments.robot, nominal, test->poses);
  }
  check_positions(arguments.robot, nominal, measurements.poses);
  arguments.options.kind = arguments.contiguous ? FoldKind::contiguous : FoldKind::random;
  Progress progress("calibrating");
  arguments.options.progress = [&](Eigen::Index done, Eigen::Index total) { progress.show(done, total); };
  const CalibrationReport report = robotics::report_calibration(nominal, measurements, arguments.options);
  progress.clear();
  const std::vector<std::string> suspicions = robotics::suspicions(nominal, measurements, report);
  const std::vector<Row> rows = rows_of(report, test);
  std::vector<std::string> written;
  const bool is_implausible = robotics::is_implausible(nominal, report);
  if (!arguments.output.empty() && !is_implausible) {
    written = save_corrected(report.best(), arguments.output, {arguments.robot, arguments.links});
  }
  std::string reports;
  if (arguments.reports.wanted()) {
    const robotics::Measurements points = robotics::orientation_rows(measurements.poses).empty()
                                              ? measurements
                                              : select(measurements, robotics::position_rows(measurements.poses));
    reports =
        write_reports(arguments.reports, report::calibration_report({arguments.robot, arguments.data, nominal, points,
                                                                     report, arguments.options, suspicions}));
  }
  if (arguments.json) {
    measurements.warnings.insert(measurements.warnings.end(), suspicions.begin(), suspicions.end());
    print_json(report_json(arguments, measurements, report, rows));
  } else {
    print_report(arguments, nominal, measurements, report, rows, suspicions);
    if (!written.empty()) {
      print(fmt::format("Written: {}\n", fmt::join(written, ", ")));
      if (robotics::is_urdf(arguments.output)) print(beside_urdf(arguments.output));
    }
    print(reports);
  }
  if (is_implausible) {
    throw std::runtime_error(fmt::format(
        "{}: the calibrated robot misses half of the points by more than a fiftieth of its length: nothing is "
        "written; check units, order, signs and zeros of the joints, and the description",
        arguments.data));
  }
  if (!report.calibration.result.converged()) {
    throw std::runtime_error(fmt::format("the calibration did not converge: {}", report.calibration.result.reason));
  }
}

}  // namespace

void add_calibrate(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "calibrate",
      "Identify a robot's parameters from measured positions\n"
      "Identifies base, tool and geometry; with --correct, learns what is left as a function of the joint "
      "values. Held-out figures: everything, the size of the correction included, is fitted without the "
      "poses it is judged on. The correction is kept if it lowers the held-out mean error by more than two "
      "standard errors of the difference; with --folds 0 it is kept without a test.");
  command->footer("Example: llmt-robot calibrate robotics/robots/ur10.yaml measured.csv --correct -o calibrated.yaml");
  const auto arguments = std::make_shared<CalibrateArguments>();
  robotics::ReportOptions& options = arguments->options;
  add_input_file(*command, "robot", arguments->robot, "Robot description (YAML or URDF)")->required();
  add_urdf_links(*command, arguments->links);
  add_input_file(*command, "data", arguments->data, "Measurements (CSV with units in the column names)")->required();
  command->add_flag("--correct", options.correct, "Learn the residual as a function of the joint values");
  add_count(*command, "--folds", options.folds, 0, "Folds of the held-out figures, 0: none")->capture_default_str();
  command->add_flag("--contiguous", arguments->contiguous, "Folds are blocks of consecutive rows: for paths and grids");
  add_input_file(*command, "--test", arguments->test, "Further measurements that take no part, judged at the end");
  add_measured_file_options(*command, arguments->reading);
  add_names(*command, "--fix", options.calibration.fixed, "PARAMETER",
            "What to keep as given: joint2.a, joint3, base, tool");
  add_names(*command, "--only", options.calibration.only, "PARAMETER",
            "Free these and no others, base and tool included");
  add_count(*command, "--max-leaves", options.correction.max_leaves, Eigen::Index{0},
            "Most leaves of a tree of the correction, 0: no limit")
      ->capture_default_str();
  add_count(*command, "--min-leaf", options.correction.min_leaf_samples, Eigen::Index{0},
            "Fewest poses in a leaf, 0: twice the coefficients of a leaf")
      ->capture_default_str();
  add_seed(*command, options.seed, "Of the random folds");
  add_threads(*command, options.max_threads);
  add_output_file(*command, "-o,--output", arguments->output,
                  "Calibrated description to write (the correction goes beside it)", {correction_extension});
  add_report_options(*command, arguments->reports, "the share of the poses below every error");
  command->add_flag("--json", arguments->json, "Print the report as JSON");
  command->callback([arguments] { calibrate_command(*arguments); });
}

}  // namespace llmt::apps
