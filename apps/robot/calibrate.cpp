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
  DecimalMark mark = DecimalMark::point;
  robotics::ReportOptions options;
  ReportFiles reports;
};

struct Row {
  std::string name;
  const robotics::Stage* stage;
  std::optional<ErrorFigures> test;
};

// Figures on measurements that took no part in anything.
ErrorFigures test_figures(const robotics::CorrectedRobot& robot, const robotics::Measurements& test) {
  return error_figures(robotics::distances(robotics::positions(robot, test.poses), test));
}

std::vector<Row> rows_of(const CalibrationReport& report, const std::optional<robotics::Measurements>& test) {
  std::vector<Row> rows = {{"nominal", &report.nominal, std::nullopt}, {"geometric", &report.geometric, std::nullopt}};
  if (report.corrected) {
    rows.push_back({"corrected", &*report.corrected, std::nullopt});
  }
  if (test) {
    rows[0].test = test_figures({report.calibration.registered, std::nullopt}, *test);
    rows[1].test = test_figures({report.calibration.robot, std::nullopt}, *test);
    if (report.corrected) {
      rows[2].test = test_figures({report.calibration.robot, report.correction->model}, *test);
    }
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
    if (row.test) {
      entry["test_mm"] = figures_json(*row.test);
    }
    json["errors"][row.name] = std::move(entry);
  }
  json["correction_kept"] = report.corrected ? Json(report.correction_kept) : Json(nullptr);
  json["decision"] = report.decision;
  json["termination"] = discovery::to_string(result.termination);
  json["iterations"] = result.iterations;
  json["identified_parameters"] = result.rank;
  json["condition_number"] = result.condition_number;
  json["coordinate_noise_mm"] = report.calibration.noise_mm;
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
  json["uncertain"] = Json::array();
  for (const robotics::IdentifiedParameter& parameter : robotics::uncertain_parameters(report.calibration.robot)) {
    json["uncertain"].push_back(parameter.name);
  }
  json["warnings"] = measurements.warnings;
  json["unused_columns"] = measurements.unused_columns;
  json["output"] = arguments.output.empty() ? Json(nullptr) : Json(arguments.output);
  return json;
}

std::string error_table(const std::vector<Row>& rows, const CalibrationReport& report, bool contiguous) {
  std::vector<std::string> header = {"position error, mm", "mean", "95 %", "max"};
  std::string above = "in-sample";
  if (report.folds > 0) {
    above += fmt::format(", then held-out ({} {} folds)", report.folds, contiguous ? "contiguous" : "random");
    header.insert(header.end(), {"| mean", "95 %", "max"});
  }
  if (rows.front().test) {
    above += ", then on the test file";
    header.insert(header.end(), {"| mean", "95 %", "max"});
  }
  Table table(header);
  for (const Row& row : rows) {
    std::vector<std::string> cells = {row.name};
    const auto add = [&](const ErrorFigures& figures) {
      for (const double value : {figures.mean, figures.p95, figures.max}) {
        cells.push_back(fmt::format("{:.4f}", value));
      }
    };
    add(error_figures(row.stage->in_sample_mm));
    if (report.folds > 0) {
      add(error_figures(row.stage->held_out_mm));
    }
    if (row.test) {
      add(*row.test);
    }
    table.add(std::move(cells));
  }
  return above + ":\n" + table.text();
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
      // Far below what lengths in mm and angles in degrees can be known to, a difference is rounding.
      const bool is_geometric = after.unit == "mm" || after.unit == "deg";
      const auto shown = [&](double value, int digits) {
        return number(is_geometric && std::abs(value) < 1e-9 ? 0.0 : value, digits);
      };
      table.add({after.name, shown(nominal_value->value, 7), shown(after.value, 7),
                 shown(after.value - nominal_value->value, 4), std::isfinite(error) ? number(error, 2) : "-",
                 after.unit});
    }
  }
  return table.text();
}

void print_report(const CalibrateArguments& arguments, const robotics::Robot& nominal,
                  const robotics::Measurements& measurements, const CalibrationReport& report,
                  const std::vector<Row>& rows, const std::vector<std::string>& suspicions) {
  const discovery::SolverResult& result = report.calibration.result;
  print(fmt::format("{}: {} poses of {}\n", arguments.data, measurements.count(), nominal.chain.name));
  for (const std::string& warning : measurements.warnings) {
    print("Note: " + warning + "\n");
  }
  if (!measurements.unused_columns.empty()) {
    print(fmt::format("Columns not used: {}\n", fmt::join(measurements.unused_columns, ", ")));
  }
  if (measurements.orientation.values.size() > 0) {
    print("The file has orientations. Calibration uses the positions only.\n");
  }
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
        "Not identified but kept as described, because they move the measured point as parameters above do, or not at "
        "all: {}\n",
        fmt::join(dependent, ", ")));
  }
  if (!kept.empty()) print(fmt::format("Kept as described by --fix or --only: {}\n", fmt::join(kept, ", ")));
  if (const std::string uncertain = uncertain_text(report.calibration.robot); !uncertain.empty()) {
    print(
        fmt::format("Uncertain values: {}. These poses do not determine each of them alone, so do not take them for "
                    "the true ones. Positions near these poses do not suffer: all values together give them.\n",
                    uncertain));
  }
  for (const discovery::Combination& combination : result.unidentifiable) {
    print(fmt::format("These poses determine only a combination of: {}\n", combination.names()));
  }
  print("\n" + error_table(rows, report, arguments.contiguous));
  print("nominal: base and tool fitted to the poses, everything else as described.\n");
  if (report.folds > 0) {
    print(
        "held-out: on poses that were left out of the fit; take these for the error at new poses. in-sample: on the "
        "poses that were fitted.\n");
  }
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
  const robotics::Robot nominal = read_description(arguments.robot, arguments.data, arguments.links);
  refuse_lost_correction(nominal, arguments.robot, arguments.output);
  robotics::Measurements measurements = robotics::read_measurements(arguments.data, nominal, {}, arguments.mark);
  if (measurements.count() < arguments.options.folds) {
    throw std::runtime_error(fmt::format("{}: {} poses do not make {} folds", arguments.data, measurements.count(),
                                         arguments.options.folds));
  }
  std::optional<robotics::Measurements> test;
  if (!arguments.test.empty()) {
    test = robotics::read_measurements(arguments.test, nominal, {}, arguments.mark);
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
    reports = write_reports(arguments.reports,
                            report::calibration_report({arguments.robot, arguments.data, nominal, measurements, report,
                                                        arguments.options, suspicions}));
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
  add_decimal_comma(*command, arguments->mark);
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
