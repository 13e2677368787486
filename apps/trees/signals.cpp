#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <stdexcept>

#include "llmt/csv.hpp"
#include "llmt/discovery/signals.hpp"
#include "llmt/files.hpp"
#include "report/signals/signals_summary.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/table_file.hpp"
#include "trees/commands.hpp"

namespace llmt::apps {
namespace {

struct SignalsArguments {
  std::string log;
  report::LogColumns columns;
  std::string output;
  double rate = 0.0;
  DecimalMark mark = DecimalMark::point;
  bool json = false;
  discovery::SignalsOptions options;
};

void check(const SignalsArguments& arguments) {
  if (arguments.columns.time.empty() == (arguments.rate == 0.0)) {
    throw std::invalid_argument("either --time COLUMN or --rate HZ is needed: when the rows were recorded");
  }
  if (arguments.options.standstill.size() > 1 &&
      arguments.options.standstill.size() != arguments.columns.positions.size()) {
    throw std::invalid_argument(fmt::format("--standstill has {} speeds for {} positions",
                                            arguments.options.standstill.size(), arguments.columns.positions.size()));
  }
}

discovery::Log read_log(const SignalsArguments& arguments, const Csv& csv) {
  const report::LogColumns& columns = arguments.columns;
  if (csv.rows() == 0) throw std::runtime_error(fmt::format("{}: no rows", csv.name()));
  std::vector<std::string> names = columns.positions;
  names.insert(names.end(), columns.torques.begin(), columns.torques.end());
  if (arguments.rate == 0.0) names.push_back(columns.time);
  const Eigen::MatrixXd numbers = csv.numbers(names);
  const Eigen::Index positions = std::ssize(columns.positions);
  discovery::Log log;
  log.positions = numbers.leftCols(positions);
  log.torques = numbers.middleCols(positions, std::ssize(columns.torques));
  if (arguments.rate == 0.0) {
    log.time = numbers.rightCols(1);
  } else {
    const auto last = static_cast<double>(csv.rows() - 1);
    log.time = Eigen::VectorXd::LinSpaced(csv.rows(), 0.0, last) / arguments.rate;
  }
  if (!columns.group.empty()) log.runs = csv.texts(columns.group);
  return log;
}

discovery::Signals filtered(const SignalsArguments& arguments, const Csv& csv) {
  const discovery::Log log = read_log(arguments, csv);
  try {
    return discovery::signals(log, arguments.options);
  } catch (const discovery::LogError& error) {
    if (error.row() < 0) throw std::runtime_error(fmt::format("{}: {}", csv.name(), error.what()));
    throw std::runtime_error(fmt::format("{}:{}: {}", csv.name(), csv.line_of(error.row()), error.what()));
  }
}

void write_signals(const std::string& path, const report::SignalsSummary& summary, const Csv& csv) {
  const report::LogColumns& columns = summary.columns;
  const discovery::Signals& signals = summary.signals;
  std::vector<std::string> header;
  for (const std::string& name : report::signal_names(columns, signals.dense)) header.push_back(csv_field(name));
  std::vector<std::vector<std::string>> kept;
  for (const std::string& name : columns.kept) kept.push_back(csv.texts(name));
  const std::vector<std::string> runs = columns.group.empty() ? std::vector<std::string>() : csv.texts(columns.group);
  const Eigen::MatrixXd values = report::signal_values(signals);
  const std::string noise = fmt::format("{}", fmt::join(report::signal_constants(summary), ","));
  std::string text = fmt::format("{}\n", fmt::join(header, ","));
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    const auto row = static_cast<std::size_t>(signals.rows[i]);
    if (!runs.empty()) text += fmt::format("{},", csv_field(runs[row]));
    text += fmt::format("{}", fmt::join(values.row(i), ","));
    for (const std::vector<std::string>& cells : kept) text += fmt::format(",{}", csv_field(cells[row]));
    text += fmt::format(",{}\n", noise);
  }
  write_file(path, text);
}

void signals_command(SignalsArguments arguments) {
  check(arguments);
  if (arguments.rate != 0.0) arguments.columns.time = "t";
  report::signal_names(arguments.columns, true);  // refuses names before the log is read
  const Csv csv = read_table(arguments.log, arguments.mark);
  report::SignalsSummary summary{.log = csv.name(),
                                 .table = arguments.output,
                                 .columns = arguments.columns,
                                 .cutoff = arguments.options.cutoff,
                                 .rows = csv.rows(),
                                 .counted = "line",
                                 .firsts = {},
                                 .lasts = {},
                                 .signals = filtered(arguments, csv)};
  for (const discovery::Stretch& stretch : summary.signals.stretches) {
    summary.firsts.push_back(csv.line_of(stretch.first));
    summary.lasts.push_back(csv.line_of(stretch.last));
  }
  if (!arguments.output.empty()) write_signals(arguments.output, summary, csv);
  if (arguments.json) {
    print_json(report::signals_json(summary));
  } else {
    print(report::signals_text(summary, output_width()));
  }
}

}  // namespace

void add_signals(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "signals", "Filter a log of positions and torques, and differentiate it, for models of the motion");
  command->footer(
      "Example: llmt signals log.csv --time t --position q1,q2 --torque u1,u2 --cutoff 10 -o table.csv\n"
      "The table has t, q1, q2, dq1, dq2, ddq1, ddq2, u1, u2, the noise of each, noise_q1 to noise_u2, and cutoff_hz.");
  const auto arguments = std::make_shared<SignalsArguments>();
  add_input_file(*command, "log", arguments->log, "Signals in the order of time (CSV; - reads standard input)")
      ->required();
  command->add_option("--time", arguments->columns.time, "Time in s")->type_name("COLUMN");
  add_number(*command, "--rate", arguments->rate, above_zero, "Samples per second, of a log without a column of time");
  add_names(*command, "--position", arguments->columns.positions, "COLUMN", "To be filtered and differentiated")
      ->required();
  add_names(*command, "--torque", arguments->columns.torques, "COLUMN", "To be filtered alone");
  add_number(*command, "--cutoff", arguments->options.cutoff, above_zero,
             "Of the low pass, in Hz: its gain is 0.71 there")
      ->required();
  add_numbers(
      *command, "--standstill", arguments->options.standstill, not_negative,
      "Leave rows out below this speed, one for all positions or one each; 0 keeps all [keep all; with --independent "
      "from the noise]");
  add_count<Eigen::Index>(*command, "--every", arguments->options.every, 1,
                          "Samples from one row to the next [a twelfth of what makes noise independent]");
  command->add_flag("--independent", arguments->options.independent,
                    "Rows whose noise is independent, without standstill and reversals: for a fit of your own");
  command->add_option("--group", arguments->columns.group, "Which run a row belongs to; no filter reaches across runs")
      ->type_name("COLUMN");
  add_names(*command, "--keep", arguments->columns.kept, "COLUMN", "To be taken over as it stands at the same time");
  add_decimal_comma(*command, arguments->mark);
  add_output_file(*command, "-o,--output", arguments->output, "Table to write (CSV)");
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->callback([arguments] { signals_command(*arguments); });
}

}  // namespace llmt::apps
