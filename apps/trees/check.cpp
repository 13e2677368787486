#include "llmt/check.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

#include "llmt/boosted_model.hpp"
#include "llmt/csv.hpp"
#include "report/document/document_text.hpp"
#include "report/model/table_check.hpp"
#include "report/table/columns.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/report_files.hpp"
#include "shared/table_file.hpp"
#include "trees/commands.hpp"
#include "trees/model_file.hpp"

namespace llmt::apps {
namespace {

struct CheckArguments {
  std::string model;
  std::string data;
  std::vector<double> limits;
  double level = 0.05;
  std::string weight;
  DecimalMark mark = DecimalMark::point;
  bool thousands = false;
  int threads = 0;
  bool json = false;
  ReportFiles reports;
};

// The targets, NaN where the table has no value; a column that it has not is NaN throughout.
Eigen::MatrixXd read_targets(const Csv& csv, const std::vector<OutputColumn>& outputs, int threads) {
  Eigen::MatrixXd targets =
      Eigen::MatrixXd::Constant(csv.rows(), std::ssize(outputs), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    if (!csv.has(outputs[o].name)) continue;
    const std::vector<std::string> column = {outputs[o].name};
    targets.col(static_cast<Eigen::Index>(o)) = csv.numbers_or_missing(column, threads);
  }
  return targets;
}

CheckOptions options_of(const CheckArguments& arguments, const Csv& csv, std::size_t targets) {
  CheckOptions options{.level = arguments.level, .limits = arguments.limits, .max_threads = arguments.threads};
  if (!options.limits.empty() && options.limits.size() != targets) {
    throw std::invalid_argument(
        fmt::format("--max-error has {} numbers, the model has {} targets", options.limits.size(), targets));
  }
  if (!arguments.weight.empty()) options.weights = positive_weights(csv, arguments.weight, arguments.threads);
  return options;
}

template <class Checked>
TableCheck check_table(const CheckArguments& arguments, const Checked& checked, const Csv& csv,
                       const report::ModelInputs& inputs, const std::vector<OutputColumn>& outputs) {
  return check(checked, inputs.values, read_targets(csv, outputs, arguments.threads),
               options_of(arguments, csv, outputs.size()));
}

void say(const CheckArguments& arguments, const report::TableCheckFacts& facts) {
  const report::Document document = report::check_document(facts);
  const std::string reports = arguments.reports.wanted() ? write_reports(arguments.reports, document) : "";
  if (arguments.json) {
    print_json(report::check_json(facts));
  } else {
    print(report::document_text(document, output_width()));
    print(reports);
  }
  switch (facts.check.verdict) {
    case CheckVerdict::good:
      return;
    case CheckVerdict::no_longer_good:
      throw std::runtime_error(report::check_refusal(facts));
    case CheckVerdict::moved_within_limits:
      throw ExitCode{exit_changed};
    case CheckVerdict::not_evaluated:
      throw ExitCode{exit_not_evaluated};
  }
}

void check_command(const CheckArguments& arguments) {
  const auto read = [&]() -> Csv {
    try {
      Csv csv = read_table(arguments.data, arguments.mark, arguments.thousands);
      if (csv.rows() == 0) throw report::NotEvaluated(fmt::format("{}: there is a header and no rows", csv.name()));
      return csv;
    } catch (const EmptyText& error) {
      throw report::NotEvaluated(error.what());
    }
  };
  report::TableCheckFacts facts{.model = arguments.model,
                                .data = table_name(arguments.data),
                                .check = {},
                                .inputs = {},
                                .tree = nullptr,
                                .words = {},
                                .level = arguments.level,
                                .has_limits = !arguments.limits.empty()};
  if (is_boosted_file(arguments.model)) {
    const BoostedModel model = load_boosted(arguments.model);
    const Csv csv = read();
    report::ModelInputs inputs = report::read_inputs(csv, model, arguments.threads);
    facts.check = check_table(arguments, model, csv, inputs, model.outputs());
    facts.inputs = model.inputs();
    facts.words = std::move(inputs.unknown_words);
    say(arguments, facts);
    return;
  }
  const ModelWithIntervals file = read_unless_exchanged(arguments.model, arguments.data, model_comes_first,
                                                        [](const std::string& path) { return load_model(path, true); });
  const Csv csv = read();
  report::ModelInputs inputs = report::read_inputs(csv, file.model, arguments.threads);
  facts.check = check_table(arguments, file, csv, inputs, file.model.outputs());
  facts.inputs = file.model.inputs();
  facts.tree = &file.model;
  facts.words = std::move(inputs.unknown_words);
  say(arguments, facts);
}

}  // namespace

void add_check(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "check",
      "Is a model still good? What of the rows changed?\n"
      "Judges a model by new rows that have the target: their error beside what the held-out rows of the fit promise, "
      "the intervals, leaves that got worse, inputs that are not as in training, and unknown categories by name. "
      "Exit codes: 0 good, 1 no longer good, 3 moved but within limits, 4 not evaluated.");
  command->footer("Example: llmt check concrete.json new.csv");
  const auto arguments = std::make_shared<CheckArguments>();
  add_input_file(*command, "model", arguments->model, "Model file of llmt fit")->required();
  add_input_file(*command, "data", arguments->data,
                 "CSV file with the model's inputs and its targets; - is standard input")
      ->required();
  add_numbers(
      *command, "--max-error", arguments->limits, above_zero,
      "RMSE up to which the model is good, one a target [a tenth above the promised error, unless within chance]");
  add_number(*command, "--level", arguments->level, NumberRange{1e-6, 0.5, "a number from 1e-6 to 0.5"},
             "Probability that something is said to have changed although nothing has")
      ->capture_default_str();
  command
      ->add_option("--weight", arguments->weight,
                   "The rows' weights, of a model that was fitted with --weight [the median weight of the fit]")
      ->type_name("COLUMN");
  add_decimal_comma(*command, arguments->mark);
  add_thousands(*command, arguments->thousands);
  add_threads(*command, arguments->threads);
  add_report_options(*command, arguments->reports, "the errors over the promised ones");
  command->add_flag("--json", arguments->json, "Print JSON");
  command->callback([arguments] { check_command(*arguments); });
}

}  // namespace llmt::apps
