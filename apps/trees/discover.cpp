#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <stdexcept>

#include "llmt/csv.hpp"
#include "llmt/files.hpp"
#include "report/signals/signals_summary.hpp"
#include "report/terms/of_terms.hpp"
#include "report/terms/terms_summary.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/report_files.hpp"
#include "trees/apply_found.hpp"
#include "trees/commands.hpp"
#include "trees/compared_tables.hpp"
#include "trees/corrected_table.hpp"
#include "trees/input_errors.hpp"
#include "trees/simulation_options.hpp"
#include "trees/term_file.hpp"

namespace llmt::apps {
namespace {

struct DiscoverArguments : ComparedTables {
  std::vector<std::string> adjusted;
  std::string terms;
  std::vector<std::string> only;
  std::vector<std::string> without;
  std::vector<std::string> input_noise;
  std::string corrected;
  SimulationArguments simulation;
  bool own_terms_only = false;
  bool json = false;
  discovery::MissingOptions options;
  ReportFiles reports;
};

// Where simulated outputs at other values of parameters come from.
struct Source {
  ParameterTable table;       // without parameters: none
  CommandSimulation command;  // without a command: none
};

// Families that nothing has are wrong usage, whatever the data.
std::vector<discovery::ModelTerm> of_families_to_try(const DiscoverArguments& arguments,
                                                     std::vector<discovery::ModelTerm> library) {
  try {
    return discovery::of_families(std::move(library), arguments.only, arguments.without);
  } catch (const std::invalid_argument& error) {
    throw CLI::ValidationError("--only, --without", error.what());
  }
}

std::vector<discovery::ModelTerm> terms_to_try(const DiscoverArguments& arguments, const Comparison& comparison,
                                               std::vector<discovery::UntestableCause>& untestable) {
  std::vector<discovery::ModelTerm> library = of_families_to_try(
      arguments, report::library_terms(comparison.inputs, comparison.simulated, arguments.outputs, untestable));
  if (arguments.terms.empty()) return library;
  std::vector<std::string> taken;
  for (const discovery::ModelTerm& term : library) taken.push_back(term.family);
  const std::string output = arguments.outputs.size() == 1 ? arguments.outputs.front() : "";
  const discovery::Rows rows = discovery::rows_of(comparison.inputs, comparison.simulated.col(0));
  return report::with_own_terms(std::move(library), read_terms(arguments.terms, comparison.inputs, output, rows, taken),
                                arguments.own_terms_only, rows);
}

// What `llmt signals` writes beside the signals: the noise of another column, and the cutoff.
bool is_constant_of_signals(const Csv& csv, const std::string& name) {
  return name == report::cutoff_column || std::ranges::any_of(csv.columns(), [&](const std::string& other) {
           return name == report::noise_column(other);
         });
}

// A column that nobody measured is often all zeros.
std::vector<std::string> notes_on_constants(const Comparison& comparison) {
  std::vector<std::string> notes;
  for (std::size_t o = 0; o < comparison.measured.names.size(); ++o) {
    const auto measured = comparison.measured.values.col(static_cast<Eigen::Index>(o)).array();
    if ((measured != measured(0)).any() ||
        (comparison.simulated.col(static_cast<Eigen::Index>(o)).array() == measured(0)).all())
      continue;
    notes.push_back(fmt::format("{} was measured as {} at every row, whatever was simulated: check the column",
                                comparison.measured.names[o], number(measured(0))));
  }
  return notes;
}

report::TermsSummary discovered(const DiscoverArguments& arguments, const Comparison& comparison,
                                const Source& source) {
  const auto adjusts = [&](const char* what) {
    return std::ranges::find(arguments.adjusted, what) != arguments.adjusted.end();
  };
  report::TermsSummary summary{.simulated = arguments.simulated,
                               .measured = arguments.measured,
                               .corrected = arguments.corrected,
                               .inputs = comparison.inputs.names,
                               .seed = arguments.options.seed,
                               .rows = comparison.simulated.rows(),
                               .missing = {},
                               .outlier_lines = {},
                               .regions = {},
                               .ranges = report::ranges_of(comparison.inputs),
                               .order = comparison.inputs.order,
                               .without_nominal = source.table.without_nominal,
                               .counted = "line",
                               .failing_lines = {},
                               .time = arguments.time,
                               .group = arguments.group};
  std::vector<discovery::UntestableCause> untestable;
  try {
    const std::vector<discovery::ModelTerm> terms = terms_to_try(arguments, comparison, untestable);
    ProgressBar bar("discover");
    discovery::MissingOptions options = arguments.options;
    options.progress = bar.callback();
    if (!source.command.command.empty()) {
      const discovery::Simulation simulation{source.command.parameters,
                                             std::bind_front(&CommandSimulation::run, source.command)};
      summary.missing = discovery::find_missing_in_steps(simulation, discovery::central_differences(simulation),
                                                         comparison.inputs, comparison.measured, terms, options);
    } else {
      discovery::Simulation simulation =
          discovery::tabulated(comparison.simulated, arguments.outputs, adjusts("offset"), adjusts("scale"));
      if (!source.table.parameters.empty()) {
        simulation = discovery::linearised(std::move(simulation), comparison.simulated, source.table.parameters,
                                           source.table.derivatives);
      }
      summary.missing = discovery::find_missing(simulation, comparison.inputs, comparison.measured, terms, options);
    }
  } catch (const discovery::RandomSimulation& error) {
    throw std::runtime_error(fmt::format("--simulate \"{}\": {}", source.command.command, error.what()));
  } catch (const std::invalid_argument& error) {
    // What the library refuses after the options were checked is in the data.
    throw std::runtime_error(fmt::format("{}: {}", arguments.measured, error.what()));
  }
  for (discovery::UntestableCause& entry : untestable) summary.missing.not_testable.push_back(std::move(entry));
  for (const std::string& note : notes_on_constants(comparison)) summary.missing.notes.push_back(note);
  for (const Eigen::Index row : summary.missing.outliers) summary.outlier_lines.push_back(comparison.lines[row]);
  for (const Eigen::Index row : summary.missing.failing_rows) summary.failing_lines.push_back(comparison.lines[row]);
  summary.regions = report::gap_regions(comparison.inputs, comparison.measured, summary.missing);
  return summary;
}

void discover_command(const CLI::App& command, DiscoverArguments arguments) {
  check(arguments.simulation);
  if (!arguments.simulation.apply.empty()) {
    if (arguments.reports.wanted()) throw std::invalid_argument("--apply makes no report");
    apply_command(command, {.found = arguments.simulation.apply,
                            .simulated = arguments.simulated,
                            .measured = arguments.measured,
                            .time = arguments.time,
                            .group = arguments.group,
                            .parameters = arguments.simulation.parameters,
                            .parameters_are_set = arguments.simulation.parameters_are_set,
                            .corrected = arguments.corrected,
                            .code = arguments.simulation.code,
                            .mark = arguments.mark,
                            .json = arguments.json});
    return;
  }
  const bool simulates = !arguments.simulation.command.empty();
  if (arguments.simulated.empty()) throw CLI::RequiredError("simulated");
  if (simulates) {
    if (!arguments.measured.empty()) throw std::invalid_argument("--simulate takes the place of the file SIMULATED");
    if (!arguments.adjusted.empty()) throw std::invalid_argument("--simulate and --allow exclude each other");
    // Its inputs are those of the measured rows.
    arguments.measured = arguments.simulated;
  }
  if (arguments.measured.empty()) throw CLI::RequiredError("measured");
  if (arguments.outputs.empty()) throw std::invalid_argument("--target is needed: the columns to explain");
  const bool named = !arguments.inputs.empty();
  if (!named) {
    const Csv simulated = Csv::read(arguments.simulated, arguments.mark);
    for (const std::string& name : simulated.columns()) {
      const bool is_output = std::ranges::find(arguments.outputs, name) != arguments.outputs.end();
      const bool is_label = name == arguments.order || name == arguments.time || name == arguments.group;
      if (!is_output && !is_label && !is_constant_of_signals(simulated, name)) arguments.inputs.push_back(name);
    }
  }
  check_names(arguments);
  Comparison comparison = read_comparison(arguments, !named);
  Source source;
  if (!arguments.simulation.parameters.empty()) {
    source.table = read_parameter_table(arguments.simulation.parameters, arguments.mark,
                                        parse_parameters(arguments.simulation.nominal_values), comparison.inputs,
                                        arguments.outputs);
  }
  if (simulates) {
    source.command = command_simulation(arguments.simulation, comparison.inputs.names, arguments.outputs);
    for (const LabelColumn& label : comparison.labels) {
      if (std::ranges::find(arguments.inputs, label.name) == arguments.inputs.end())
        source.command.labels.push_back(label);
    }
    comparison.simulated = source.command.run(comparison.inputs.values, source.command.nominal());
    arguments.simulated = "--simulate";
  }
  if (!arguments.input_noise.empty()) {
    comparison.inputs.noise = errors_of_inputs(arguments.input_noise, comparison.inputs.names);
  }
  const report::TermsSummary summary = discovered(arguments, comparison, source);
  const bool is_worse = discovery::is_worse(summary.missing);
  if (!arguments.corrected.empty() && !is_worse) {
    write_corrected(arguments.corrected,
                    {comparison.inputs.names, arguments.outputs, comparison.inputs.values, comparison.simulated,
                     summary.missing.corrected, comparison.measured.values, comparison.labels});
  }
  if (!arguments.simulation.code.empty() && !is_worse) {
    write_code(arguments.simulation.code, report::found_terms(report::terms_json(summary), arguments.measured));
  }
  std::string reports;
  if (arguments.reports.wanted()) {
    reports = write_reports(arguments.reports,
                            report::terms_report({arguments.simulated, arguments.measured, comparison.inputs,
                                                  comparison.measured.values, summary.missing}));
  }
  if (arguments.json) {
    print_json(report::terms_json(summary));
  } else {
    print(report::terms_text(summary, output_width()) + reports);
  }
}

}  // namespace

void add_discover(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("discover", "Find and name what a simulation lacks, from measurements beside it");
  command->footer("Example: llmt discover simulated.csv measured.csv --inputs a,b,t --target y -o corrected.csv");
  const auto arguments = std::make_shared<DiscoverArguments>();
  add_input_file(*command, "simulated", arguments->simulated, "Inputs and simulated outputs (CSV)");
  add_input_file(*command, "measured", arguments->measured, "The same inputs, row by row, and measured outputs (CSV)");
  add_names(*command, "-t,--target", arguments->outputs, "COLUMN", "What to explain, in both files (required)");
  add_names(*command, "--inputs", arguments->inputs, "COLUMN",
            "What the gap may depend on [all of SIMULATED but the targets]");
  command
      ->add_option("--order", arguments->order,
                   "What says in which order rows were measured; it is an input too [rows as they stand]")
      ->type_name("COLUMN");
  command
      ->add_option("--time", arguments->time,
                   "When each row was taken, for rows that follow each other in time; no input by itself")
      ->type_name("COLUMN");
  command->add_option("--group", arguments->group, "Recording that each row is of; with --time")->type_name("COLUMN");
  add_names(
      *command, "--input-noise", arguments->input_noise, "INPUT=NUMBER",
      "Standard deviations of the errors of inputs, or auto: from neighbouring rows [columns noise_INPUT of MEASURED, "
      "else auto for rows in time, else 0]");
  add_names(*command, "--only", arguments->only, "FAMILY", "Try the built-in terms of these families alone");
  add_names(*command, "--without", arguments->without, "FAMILY", "Do not try the built-in terms of these families");
  add_input_file(*command, "--terms", arguments->terms,
                 "File of your own terms, a line each: name = expression of the inputs");
  command
      ->add_flag("--own-terms-only", arguments->own_terms_only, "Leave the built-in terms out, but for unknown shapes")
      ->needs("--terms");
  add_names(*command, "--allow", arguments->adjusted, "offset|scale",
            "What the simulation may adjust before anything counts as missing")
      ->check([](const std::string& text) {
        const CLI::IsMember adjustable({"offset", "scale"});
        for (const std::string& name : names_in(text)) {
          if (std::string refusal = adjustable(name); !refusal.empty()) return refusal;
        }
        return std::string();
      });
  add_simulation_options(*command, arguments->simulation);
  add_number(*command, "--held-out", arguments->options.held_out_share, share_set_aside,
             "Share of the rows set aside for verification")
      ->capture_default_str();
  add_seed(*command, arguments->options.seed, "Of the rows set aside");
  add_decimal_comma(*command, arguments->mark);
  add_output_file(*command, "-o,--output", arguments->corrected, "Corrected simulation to write (CSV)");
  add_report_options(*command, arguments->reports, "the gap before and after");
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->callback([command, arguments] { discover_command(*command, *arguments); });
}

}  // namespace llmt::apps
