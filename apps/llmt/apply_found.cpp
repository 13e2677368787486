#include "llmt/apply_found.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "llmt/corrected_table.hpp"
#include "llmt/files.hpp"
#include "llmt/parameter_table.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

// Outputs by their names, or by those that -o gives them.
Eigen::MatrixXd outputs_of(const Csv& csv, const std::vector<std::string>& outputs, const char* ending) {
  std::vector<std::string> columns;
  for (const std::string& output : outputs) columns.push_back(csv.has(output) ? output : output + ending);
  return csv.numbers(columns);
}

// n x d, or empty if there are none.
Eigen::MatrixXd measured_outputs(const ApplyArguments& arguments, const report::FoundTerms& found,
                                 const Csv& simulated) {
  const std::vector<std::string> outputs = found.output_names();
  if (!arguments.measured.empty()) {
    const Csv measured = Csv::read(arguments.measured, arguments.mark);
    if (measured.rows() != simulated.rows()) {
      throw std::runtime_error(fmt::format("{} has {} rows, {} has {}", simulated.name(), simulated.rows(),
                                           measured.name(), measured.rows()));
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

void apply_found(const ApplyArguments& arguments) {
  const report::FoundTerms found = report::found_terms(read_file(arguments.found, description_limit), arguments.found);
  std::string text;
  if (!arguments.code.empty()) {
    write_code(arguments.code, found);
    text += fmt::format("Correction written to {}\n", arguments.code);
  }
  if (arguments.simulated.empty()) {
    print(text);
    return;
  }
  const Csv simulated = Csv::read(arguments.simulated, arguments.mark);
  if (simulated.rows() == 0) throw std::runtime_error(fmt::format("{}: no rows", simulated.name()));
  CorrectedTable table{.inputs = found.input_names(),
                       .outputs = found.output_names(),
                       .values = simulated.numbers(found.input_names()),
                       .simulated = outputs_of(simulated, found.output_names(), "_simulated"),
                       .corrected = {},
                       .measured = measured_outputs(arguments, found, simulated)};
  const bool is_measured = table.measured.size() > 0;
  if (arguments.corrected.empty() && arguments.code.empty() && !is_measured) {
    throw std::invalid_argument("--apply without measured outputs needs --output: the corrected simulation to write");
  }
  table.corrected = report::apply(found, table.values, table.simulated, derivatives_of(arguments, found, table.values));
  if (!arguments.corrected.empty()) write_corrected(arguments.corrected, table);
  const std::vector<std::string> outside = report::outside_sentences(found, table.values);
  Json gaps = Json::array();
  Table gap_table({"output", "before", "after"});
  std::vector<std::string> grown;
  for (std::size_t o = 0; is_measured && o < table.outputs.size(); ++o) {
    const auto column = static_cast<Eigen::Index>(o);
    const double before = rms(table.measured.col(column) - table.simulated.col(column));
    const double after = rms(table.measured.col(column) - table.corrected.col(column));
    gaps.push_back({{"output", table.outputs[o]}, {"before", before}, {"after", after}});
    gap_table.add({table.outputs[o], number(before), number(after)});
    if (after > before) {
      grown.push_back(fmt::format("The gap of {} is larger with what was found: it does not hold for these rows",
                                  table.outputs[o]));
    }
  }
  if (arguments.json) {
    Json notes = grown;
    for (const std::string& sentence : outside) notes.push_back(sentence);
    print_json({{"rows", table.values.rows()}, {"gap", gaps}, {"notes", notes}});
    return;
  }
  text = fmt::format("{} applied to {}: {} rows, {} {}\n", arguments.found, arguments.simulated, table.values.rows(),
                     found.terms.size(), found.terms.size() == 1 ? "term" : "terms") +
         text;
  if (is_measured) text += "\nGap, root mean square:\n" + gap_table.text(output_width());
  for (const std::string& sentence : grown) text += "\n" + sentence + ".\n";
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

void apply_command(const CLI::App& command, ApplyArguments arguments, const std::vector<std::string>& outputs) {
  for (const char* option : {"--target", "--inputs", "--order", "--terms", "--allow", "--held-out"}) {
    if (command.get_option(option)->count() > 0) {
      throw std::invalid_argument(fmt::format("--apply excludes {}: what was found says it", option));
    }
  }
  if (outputs.size() > 1) throw std::invalid_argument(fmt::format("--output names {} files", outputs.size()));
  if (!outputs.empty()) {
    check_output_file(command, "--output", outputs.front());
    arguments.corrected = outputs.front();
  }
  apply_found(arguments);
}

}  // namespace llmt::apps
