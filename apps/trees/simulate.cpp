#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/run_band.hpp"
#include "llmt/simulator.hpp"
#include "report/dynamic/dynamic_report.hpp"
#include "report/dynamic/system_document.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/report_files.hpp"
#include "shared/table_file.hpp"
#include "trees/commands.hpp"
#include "trees/series_table.hpp"

namespace llmt::apps {
namespace {

struct SimulateArguments {
  std::string model;
  std::string data;
  std::string output;
  std::string time;
  std::string groups;
  std::vector<double> initial;
  Eigen::Index window = 0;
  double interval = 0.0;
  DecimalMark mark = DecimalMark::point;
  bool thousands = false;
  bool json = false;
  ReportFiles reports;
};

std::vector<std::string> names_of_signals(const std::vector<Signal>& signals) {
  std::vector<std::string> names;
  for (const Signal& signal : signals) names.push_back(signal.name);
  return names;
}

void check_step(const Csv& csv, const SimulateArguments& arguments, const DynamicParts& parts, const Series& series) {
  if (arguments.time.empty() || series.rows() < 2) return;
  if (std::abs(series.sample_time - parts.sample_time) <= 0.01 * parts.sample_time) return;
  throw std::runtime_error(fmt::format("{}: column \"{}\": a row every {:.6g} {}, the model has one every {:.6g} {}",
                                       csv.name(), arguments.time, series.sample_time, parts.time_unit,
                                       parts.sample_time, parts.time_unit));
}

// The outputs that a run over a record begins with.
Eigen::MatrixXd initial_outputs(const Csv& csv, const SimulateArguments& arguments, const DynamicModel& model,
                                const SeriesTable& table, const Stretch& record) {
  if (!arguments.initial.empty()) {
    if (std::ssize(arguments.initial) != model.num_outputs()) {
      throw std::invalid_argument(fmt::format("--initial has {} values, the model has {} outputs",
                                              arguments.initial.size(), model.num_outputs()));
    }
    return Eigen::Map<const Eigen::RowVectorXd>(arguments.initial.data(), std::ssize(arguments.initial));
  }
  const Eigen::Index rows = std::min(record.rows(), std::max<Eigen::Index>({arguments.window, model.memory(), 1}));
  for (Eigen::Index row = record.begin; row < record.begin + rows; ++row) {
    for (Eigen::Index o = 0; o < model.num_outputs(); ++o) {
      if (std::isfinite(table.series.outputs(row, o))) continue;
      throw std::runtime_error(
          fmt::format("{}:{}: the output \"{}\" is not there; a run begins with {} measured rows, or with --initial",
                      csv.name(), table.lines[row], model.parts().outputs[o].name, rows));
    }
  }
  return table.series.outputs.middleRows(record.begin, rows);
}

// The band of a run. What cannot be had is the file's fault, not the caller's.
Bounds band_of(const SimulateArguments& arguments, const DynamicModel& model, const Run& run) {
  if (model.parts().band.outputs.empty()) {
    throw std::runtime_error(fmt::format(
        "{}: the file has no errors of held-out runs; an earlier program wrote it, fit again", arguments.model));
  }
  try {
    return run_bounds(model, run, arguments.interval);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", arguments.model, error.what()));
  }
}

void simulate_command(const SimulateArguments& arguments) {
  const DynamicModel model = read_unless_exchanged(arguments.model, arguments.data, model_comes_first,
                                                   [](const std::string& path) { return load_dynamic(path); });
  const Csv csv = read_table(arguments.data, arguments.mark, arguments.thousands);
  SeriesColumns columns{names_of_signals(model.parts().inputs), names_of_signals(model.parts().outputs), arguments.time,
                        arguments.groups};
  const SeriesTable table = read_series(csv, columns, true);
  check_step(csv, arguments, model.parts(), table.series);
  const Eigen::MatrixXd& inputs = table.series.inputs;
  for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
    if (inputs.cols() == 0 || inputs.row(row).allFinite()) continue;
    throw std::runtime_error(
        fmt::format("{}:{}: an input is missing; a run needs all of them", csv.name(), table.lines[row]));
  }
  report::SimulatedRecords simulated{
      csv.name(), model, table.series, Eigen::MatrixXd(inputs.rows(), model.num_outputs()), {}, table.lines};
  for (const std::string& output : columns.outputs) {
    simulated.has_measured = simulated.has_measured || csv.has(output);
  }
  simulated.level = arguments.interval;
  if (simulated.level > 0.0) simulated.band = {simulated.outputs, simulated.outputs};
  for (const Stretch& record : records_of(table.series)) {
    const Eigen::MatrixXd initial = initial_outputs(csv, arguments, model, table, record);
    simulated.runs.push_back(simulate(model, inputs.middleRows(record.begin, record.rows()), initial));
    simulated.outputs.middleRows(record.begin, record.rows()) = simulated.runs.back().outputs;
    simulated.initial = initial.rows();
    if (arguments.interval == 0.0) continue;
    const Bounds band = band_of(arguments, model, simulated.runs.back());
    simulated.band.lower.middleRows(record.begin, record.rows()) = band.lower;
    simulated.band.upper.middleRows(record.begin, record.rows()) = band.upper;
  }
  if (!arguments.output.empty()) write_file(arguments.output, report::simulated_table(simulated));
  std::string words;
  if (arguments.reports.wanted()) words = write_reports(arguments.reports, report::simulated_document(simulated));
  if (arguments.json) {
    print_json(report::simulated_json(simulated));
  } else {
    if (arguments.output.empty()) print_bytes(report::simulated_table(simulated));
    words = report::simulated_text(simulated) + words;
  }
  std::istringstream lines(words);
  for (std::string line; std::getline(lines, line);) warn(line);
}

}  // namespace

void add_simulate(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("simulate",
                         "Run a model of a system that moves\n"
                         "The model's own outputs are its past: after the first rows nothing measured is used. Writes "
                         "TARGET_simulated for "
                         "each row. Where the table holds the targets, their RMSE and fit in per cent are reported.");
  command->footer("Example: llmt simulate drive.json inputs.csv -o simulated.csv");
  const auto arguments = std::make_shared<SimulateArguments>();
  add_input_file(*command, "model", arguments->model, "Model file of llmt fit --lags")->required();
  add_input_file(*command, "data", arguments->data, "CSV file with the model's inputs; - is standard input")
      ->required();
  add_output_file(*command, "-o,--output", arguments->output, "CSV file to write [standard output]");
  constexpr NumberRange value = {-1e150, 1e150, "numbers"};
  add_numbers(*command, "--initial", arguments->initial, value,
              "The outputs at the first row, where the system is at rest [the measured ones of the first rows]");
  add_count(*command, "--window", arguments->window, Eigen::Index{0},
            "Measured rows before the run, if more than the lags need");
  constexpr NumberRange level = {0.01, 0.9999, "a number from 0.01 to 0.9999"};
  add_number(*command, "--interval", arguments->interval, level,
             "Level of a band about the run, such as 0.9: adds TARGET_low and TARGET_high, between which that share of "
             "measured values lies, as runs over held-out stretches tell");
  command->add_option("--time", arguments->time, "The times of the rows, to be checked against the model's step")
      ->type_name("COLUMN");
  command->add_option("--groups", arguments->groups, "The record of each row; each begins anew")->type_name("COLUMN");
  add_decimal_comma(*command, arguments->mark);
  add_thousands(*command, arguments->thousands);
  add_report_options(*command, arguments->reports, "the run over time");
  command->add_flag("--json", arguments->json, "Print JSON with the run and its errors");
  command->callback([arguments] { simulate_command(*arguments); });
}

}  // namespace llmt::apps
