#include "trees/apply_found.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "llmt/files.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "trees/corrected_table.hpp"
#include "trees/parameter_table.hpp"

namespace llmt::apps {
namespace {

// Outputs by their names, or by those that -o gives them.
Eigen::MatrixXd outputs_of(const Csv& csv, const std::vector<std::string>& outputs, const char* ending) {
  std::vector<std::string> columns;
  for (const std::string& output : outputs) columns.push_back(csv.has(output) ? output : output + ending);
  return csv.numbers(columns);
}

// Times and runs of the rows, from the columns of these names or those of the search.
struct Times {
  report::RowTimes of_rows;
  std::vector<LabelColumn> labels;
  std::string column;  // of the times; may be empty
};

Times times_of(const ApplyArguments& arguments, const report::FoundTerms& found, const Csv& csv) {
  Times times;
  const auto column = [&](const std::string& given, const std::string& known, const char* option) -> std::string {
    if (!given.empty()) return given;
    if (known.empty() || csv.has(known)) return known;
    if (!found.needs_time()) return "";
    throw std::runtime_error(
        fmt::format("{}: there is no column \"{}\", as in the search; terms of {} depend on the "
                    "past of a run ({} COLUMN names it)",
                    csv.name(), known, found.file, option));
  };
  if (const std::string name = column(arguments.time, found.time, "--time"); !name.empty()) {
    times.of_rows.instants = instants_of(csv, name);
    times.column = name;
    times.labels.push_back({name, csv.texts(name)});
  }
  if (const std::string name = column(arguments.group, found.group, "--group"); !name.empty()) {
    times.of_rows.runs = runs_of(csv, name);
    times.labels.push_back({name, csv.texts(name)});
  }
  return times;
}

// n x d, or empty if there are none.
Eigen::MatrixXd measured_outputs(const ApplyArguments& arguments, const report::FoundTerms& found, const Csv& simulated,
                                 const Times& times) {
  const std::vector<std::string> outputs = found.output_names();
  if (!arguments.measured.empty()) {
    const Csv measured = Csv::read(arguments.measured, arguments.mark);
    if (measured.rows() != simulated.rows()) {
      throw std::runtime_error(fmt::format("{} has {} rows, {} has {}", simulated.name(), simulated.rows(),
                                           measured.name(), measured.rows()));
    }
    std::vector<std::string> both;
    for (const std::string& name : found.input_names()) {
      if (measured.has(name)) both.push_back(name);
    }
    read_same_inputs(simulated, measured, both, false);
    if (!times.column.empty() && measured.has(times.column)) {
      refuse_other_times(simulated, measured, times.column, instants_of(measured, times.column));
    }
    return outputs_of(measured, outputs, "_measured");
  }
  for (const std::string& output : outputs) {
    if (!simulated.has(output + "_measured")) return {};
  }
  return outputs_of(simulated, outputs, "_measured");
}

std::map<std::string, Eigen::MatrixXd> derivatives_of(const ApplyArguments& arguments, const report::FoundTerms& found,
                                                      const Eigen::MatrixXd& inputs) {
  std::map<std::string, Eigen::MatrixXd> derivatives;
  if (found.changes.empty() || arguments.parameters_are_set) return derivatives;
  std::vector<std::string> names;
  for (const report::FoundTerms::Change& change : found.changes) names.push_back(change.parameter);
  if (arguments.parameters.empty()) {
    throw std::invalid_argument(fmt::format(
        "{} changes parameters of the simulation ({}): --parameters FILE with the derivatives by them at these rows is "
        "needed, or --parameters-are-set where the simulated outputs were computed with their new values",
        found.file, fmt::join(names, ", ")));
  }
  const ParameterTable table = read_parameter_table(arguments.parameters, arguments.mark, {},
                                                    {found.input_names(), inputs, found.order}, found.output_names());
  for (std::size_t k = 0; k < table.parameters.size(); ++k) {
    derivatives[table.parameters[k].name] = table.derivatives[k];
  }
  for (const std::string& name : names) {
    if (!derivatives.contains(name)) {
      throw std::runtime_error(
          fmt::format("{}: no derivatives by \"{}\", which {} changes", arguments.parameters, name, found.file));
    }
  }
  return derivatives;
}

double rms(const Eigen::VectorXd& errors) {
  return std::sqrt(errors.squaredNorm() / static_cast<double>(errors.size()));
}

struct RowsOf {
  std::string run;  // empty: all
  std::vector<Eigen::Index> rows;
};

// All rows, and those of each run where there are several.
std::vector<RowsOf> rows_by_run(const Times& times, Eigen::Index n) {
  std::vector<RowsOf> all(1);
  std::vector<RowsOf> runs;
  for (Eigen::Index i = 0; i < n; ++i) {
    all.front().rows.push_back(i);
    if (times.of_rows.runs.empty()) continue;
    const auto run = static_cast<std::size_t>(times.of_rows.runs[i]);
    if (run == runs.size()) runs.push_back({times.labels.back().cells[i], {}});
    runs[run].rows.push_back(i);
  }
  if (runs.size() > 1) all.insert(all.end(), runs.begin(), runs.end());
  return all;
}

// Gaps before and after, of all rows and of each run.
struct Gaps {
  Json json = Json::array();
  Json runs = Json::array();
  std::string text;
  std::vector<std::string> grown;
};

Gaps gaps_of(const CorrectedTable& table, const Times& times) {
  Gaps gaps;
  const bool has_runs = !times.of_rows.runs.empty();
  Table of_rows(has_runs ? std::vector<std::string>{"output", "run", "before", "after"}
                         : std::vector<std::string>{"output", "before", "after"});
  const std::vector<RowsOf> parts = rows_by_run(times, table.values.rows());
  for (std::size_t o = 0; o < table.outputs.size(); ++o) {
    const auto column = static_cast<Eigen::Index>(o);
    for (const RowsOf& part : parts) {
      const bool is_all = &part == &parts.front();
      const Eigen::VectorXd measured = table.measured.col(column)(part.rows);
      const double before = rms(measured - table.simulated.col(column)(part.rows));
      const double after = rms(measured - table.corrected.col(column)(part.rows));
      Json gap = {{"output", table.outputs[o]}, {"before", before}, {"after", after}};
      if (!is_all) gap["run"] = part.run;
      (is_all ? gaps.json : gaps.runs).push_back(gap);
      std::vector<std::string> cells{table.outputs[o]};
      if (has_runs) cells.push_back(is_all ? "all" : part.run);
      cells.insert(cells.end(), {number(before), number(after)});
      of_rows.add(std::move(cells));
      if (after > before) {
        gaps.grown.push_back(fmt::format("The gap of {} is larger with what was found{}", table.outputs[o],
                                         is_all ? ": it does not hold for these rows"
                                                : fmt::format(" in the run \"{}\": it does not hold there", part.run)));
      }
    }
  }
  gaps.text = "\nGap, root mean square:\n" + of_rows.text(output_width());
  return gaps;
}

void apply_found(const ApplyArguments& arguments) {
  const report::FoundTerms found = report::found_terms(read_file(arguments.found, description_limit), arguments.found);
  std::string text;
  if (!arguments.code.empty()) {
    if (!found.refused.empty()) {
      throw std::runtime_error(fmt::format("{}: there is nothing to write as code: the verdict of the search is \"{}\"",
                                           found.file, found.refused));
    }
    write_code(arguments.code, found);
    text += fmt::format("Correction written to {}\n", arguments.code);
  }
  if (arguments.simulated.empty()) {
    print(text);
    return;
  }
  const Csv simulated = Csv::read(arguments.simulated, arguments.mark);
  if (simulated.rows() == 0) throw std::runtime_error(fmt::format("{}: no rows", simulated.name()));
  const Times times = times_of(arguments, found, simulated);
  CorrectedTable table{.inputs = found.input_names(),
                       .outputs = found.output_names(),
                       .values = simulated.numbers(found.input_names()),
                       .simulated = outputs_of(simulated, found.output_names(), "_simulated"),
                       .corrected = {},
                       .measured = measured_outputs(arguments, found, simulated, times),
                       .labels = times.labels};
  const bool is_measured = table.measured.size() > 0;
  if (arguments.corrected.empty() && arguments.code.empty() && !is_measured) {
    throw std::invalid_argument("--apply without measured outputs needs --output: the corrected simulation to write");
  }
  table.corrected = report::apply(found, table.values, table.simulated, derivatives_of(arguments, found, table.values),
                                  times.of_rows);
  if (!arguments.corrected.empty()) write_corrected(arguments.corrected, table);
  std::vector<std::string> outside = report::outside_sentences(found, table.values);
  if (!found.refused.empty()) {
    outside = {fmt::format("nothing is added, because the verdict of the search is \"{}\"", found.refused)};
  }
  const Gaps gaps = is_measured ? gaps_of(table, times) : Gaps();
  if (arguments.json) {
    Json notes = gaps.grown;
    for (const std::string& sentence : outside) notes.push_back(sentence);
    Json json = {{"rows", table.values.rows()}, {"gap", gaps.json}, {"notes", notes}};
    if (!gaps.runs.empty()) json["runs"] = gaps.runs;
    print_json(json);
    return;
  }
  text = fmt::format("{} applied to {}: {} rows, {} {}\n", arguments.found, arguments.simulated, table.values.rows(),
                     found.terms.size(), found.terms.size() == 1 ? "term" : "terms") +
         text + gaps.text;
  for (const std::string& sentence : gaps.grown) text += "\n" + sentence + ".\n";
  for (const std::string& sentence : outside) text += "\nNote: " + sentence + ".\n";
  if (!arguments.corrected.empty()) text += fmt::format("\nCorrected simulation written to {}\n", arguments.corrected);
  print(text);
}

}  // namespace

void write_code(const std::string& path, const report::FoundTerms& found) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension != ".c" && extension != ".py") {
    throw std::invalid_argument(fmt::format("--code: \"{}\" must end with .c or .py", path));
  }
  write_file(
      path, report::correction_code(found, extension == ".c" ? report::CodeLanguage::c : report::CodeLanguage::python));
}

void apply_command(const CLI::App& command, const ApplyArguments& arguments) {
  for (const char* option : {"--target", "--inputs", "--order", "--terms", "--allow", "--held-out", "--only",
                             "--without", "--own-terms-only", "--input-noise", "--seed"}) {
    if (command.get_option(option)->count() > 0) {
      throw std::invalid_argument(fmt::format("--apply excludes {}: what was found says it", option));
    }
  }
  apply_found(arguments);
}

}  // namespace llmt::apps
