#include "trees/dynamic_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "llmt/fit_dynamic.hpp"
#include "report/dynamic/dynamic_report.hpp"
#include "report/dynamic/system_document.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/progress.hpp"
#include "shared/table_file.hpp"
#include "trees/series_table.hpp"

namespace llmt::apps {
namespace {

constexpr std::array own_options = {"time", "for", "grid", "delay", "accept-unstable"};
constexpr std::array taken_options = {"help",          "help-all",  "data",   "target", "inputs", "ignore",   "groups",
                                      "decimal-comma", "thousands", "output", "json",   "boost",  "readable", "rule",
                                      "max-leaves",    "threads",   "lags",   "report", "plot"};

void refuse_others(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = option->get_single_name();
    const bool is_taken = std::ranges::find(taken_options, name) != taken_options.end() ||
                          std::ranges::find(own_options, name) != own_options.end();
    if (option->count() > 0 && !is_taken) {
      throw std::invalid_argument(fmt::format("--{} is not for systems that move (--lags)", name));
    }
  }
}

// Rows that a run goes on; 0: to the end.
Eigen::Index horizon_of(const std::string& purpose) {
  if (purpose == "simulation") return 0;
  if (purpose == "prediction") return 1;
  try {
    return read_count("--for", purpose, 1, 1'000'000);
  } catch (const std::invalid_argument&) {
    throw std::invalid_argument(
        fmt::format("--for is \"{}\", it must be simulation, prediction or a number of rows", purpose));
  }
}

SeriesColumns columns_of_series(const Csv& csv, const DynamicFitArguments& arguments) {
  LearningArguments learning = arguments.learning;
  if (!arguments.dynamic.time.empty()) {
    csv.index_of(arguments.dynamic.time);
    learning.ignored.push_back(arguments.dynamic.time);
  }
  SeriesColumns columns;
  columns.outputs = learning.targets;
  columns.time = arguments.dynamic.time;
  columns.groups = learning.groups;
  columns.grid = arguments.dynamic.grid;
  columns.threads = learning.options.max_threads;
  // A series may have no input: choose_inputs() refuses that.
  const bool has_others = std::ranges::any_of(csv.columns(), [&](const std::string& column) {
    const auto is_in = [&](const std::vector<std::string>& names) {
      return std::ranges::find(names, column) != names.end();
    };
    return !is_in(learning.targets) && !is_in(learning.ignored) && column != learning.groups;
  });
  if (has_others || !learning.inputs.empty()) columns.inputs = choose_inputs(csv, learning);
  return columns;
}

DynamicOptions options_of(const CLI::App& command, const DynamicFitArguments& arguments, const Series& series) {
  DynamicOptions options;
  options.horizon = horizon_of(arguments.dynamic.purpose);
  options.max_threads = arguments.learning.options.max_threads;
  if (arguments.dynamic.lags != "auto") {
    try {
      options.lags = parse_lags(arguments.dynamic.lags, series.input_names, series.output_names);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("--{}", error.what()));
    }
  }
  const std::string& delay = arguments.dynamic.delay;
  if (delay == "auto") {
    options.delays.assign(series.input_names.size(), find_delay);
  } else if (!delay.empty()) {
    try {
      options.delays = parse_delays(delay, series.input_names, options.lags ? 0 : find_delay);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("--{}", error.what()));
    }
  }
  if (command.count("--rule") > 0) {
    options.rest = RestLearner::tree;
    options.rule = arguments.learning.options.rule;
  }
  if (command.count("--max-leaves") > 0) {
    options.max_leaves = std::max<Eigen::Index>(arguments.learning.options.max_leaves, 1);
  }
  if (arguments.boost && arguments.readable) throw std::invalid_argument("--readable is not for --boost");
  if (arguments.boost) options.rest = RestLearner::sum;
  if (arguments.readable) options.rest = RestLearner::readable;
  return options;
}

}  // namespace

void add_dynamic_options(CLI::App& command, DynamicArguments& arguments) {
  command
      .add_option(
          "--lags", arguments.lags,
          "Learn a system that moves: the rows are one record in time, and the model looks back. auto: found on "
          "held-out stretches; or lags in rows as y:1-3,u:0-4, of targets from 1 on, y:+1-3 for a target that adds up "
          "its changes. llmt simulate runs it")
      ->type_name("LAGS");
  command.add_option("--time", arguments.time, "With --lags: the times of the rows, at equal steps [1 each]")
      ->type_name("COLUMN");
  command
      .add_option("--delay", arguments.delay,
                  "With --lags: dead time of inputs in rows as u:3, from which their lags count. auto: found on "
                  "held-out stretches, 40 rows at most [auto lags: 10 rows at most; else none]")
      ->type_name("DELAY");
  constexpr NumberRange step = {1e-300, 1e300, "a positive number"};
  add_number(
      command, "--grid", arguments.grid, step,
      "With --lags: interpolate rows at unequal steps to this step of --time; longer gaps than five of them stay "
      "missing");
  command
      .add_option("--for", arguments.purpose,
                  "With --lags: what the model is chosen for: simulation (free runs), prediction (of the next row), or "
                  "runs of so many rows")
      ->type_name("simulation|prediction|ROWS")
      ->capture_default_str();
  command.add_flag("--accept-unstable", arguments.accept_unstable,
                   "With --lags: write the model although a run over a held-out stretch left all bounds");
}

void refuse_dynamic_options(const CLI::App& command) {
  for (const char* name : own_options) {
    const std::string option = fmt::format("--{}", name);
    if (command.count(option) > 0) throw std::invalid_argument(option + " is for systems that move: give --lags too");
  }
}

void dynamic_fit_command(const CLI::App& command, const DynamicFitArguments& arguments) {
  refuse_others(command);
  const LearningArguments& learning = arguments.learning;
  const Csv csv = read_table(learning.data, learning.mark, learning.thousands);
  const SeriesTable table = read_series(csv, columns_of_series(csv, arguments));
  const DynamicOptions options = options_of(command, arguments, table.series);
  ProgressBar bar("running models");
  const DynamicFit fit = [&] {
    try {
      return fit_dynamic(table.series, options, bar.callback());
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(fmt::format("{}: {}", csv.name(), in_words_of_user(error.what(), {})));
    }
  }();
  bar.clear();
  const bool is_written =
      !arguments.output.empty() && (fit.model.parts().is_stable || arguments.dynamic.accept_unstable);
  if (is_written) save(fit.model, arguments.output);
  const report::DynamicRun run{csv.name(), is_written ? arguments.output : "", table.series, fit, options.horizon};
  const std::string reports =
      arguments.reports.wanted() ? write_reports(arguments.reports, report::dynamic_document(run)) : "";
  if (arguments.json) {
    print_json(report::dynamic_json(run));
  } else {
    print(report::dynamic_text(run, output_width()));
    print(reports);
    if (is_written) print(fmt::format("Model written to {}; llmt simulate runs it\n", arguments.output));
    if (arguments.output.empty()) print("Not written: give -o FILE.json\n");
  }
  if (!fit.model.parts().is_stable && !is_written && !arguments.output.empty()) {
    warn(
        "llmt: a run over a held-out stretch left all bounds, so the model is not written; --accept-unstable writes "
        "it");
    throw ExitCode{exit_refused};
  }
}

}  // namespace llmt::apps
