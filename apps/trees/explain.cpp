#include "llmt/explain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "llmt/boosted_explain.hpp"
#include "llmt/csv.hpp"
#include "llmt/model.hpp"
#include "report/model/explanation.hpp"
#include "report/table/columns.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/table_file.hpp"
#include "trees/commands.hpp"
#include "trees/model_file.hpp"

namespace llmt::apps {
namespace {

struct ExplainArguments {
  std::string model;
  std::string data;
  Eigen::Index row = 0;  // counted from 1; 0: the whole table
  DecimalMark mark = DecimalMark::point;
  bool thousands = false;
  bool json = false;
  int threads = 0;
};

void warn_if_not_finite(const ExplainArguments& arguments, const char* what, const Eigen::MatrixXd& values) {
  if (const Eigen::Index count = values.size() - values.array().isFinite().count(); count > 0) {
    warn(fmt::format("llmt: warning: {} of {} {} are not finite: numbers of {} are too large for these rows", count,
                     values.size(), what, arguments.model));
  }
}

// Sums of trees are explained against the mean over at most this many rows.
constexpr Eigen::Index most_background = 100;

// What a call on the model says is wrong, with the file's name.
template <class Call>
auto with_name(const std::string& path, const Call& call) {
  try {
    return call();
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", path, error.what()));
  }
}

std::string mean_over(Eigen::Index rows) { return fmt::format("on average over {} rows of the table", rows); }

Eigen::Index rows_of_importance(const Model& /*model*/, const Eigen::MatrixXd& inputs, std::string& /*beginning*/) {
  return std::min(inputs.rows(), importance_rows);
}

Eigen::Index rows_of_importance(const BoostedModel& /*model*/, const Eigen::MatrixXd& inputs, std::string& beginning) {
  beginning = mean_over(std::min(inputs.rows(), boosted_importance_background));
  return std::min(inputs.rows(), boosted_importance_rows);
}

template <class AnyModel>
void explain_table(const ExplainArguments& arguments, const AnyModel& model, const Eigen::MatrixXd& inputs) {
  report::TableExplanation explanation{
      .model = arguments.model,
      .data = arguments.data,
      .rows = inputs.rows(),
      .shares = with_name(arguments.model, [&] { return importance(model, inputs, arguments.threads); })};
  explanation.rows_used = rows_of_importance(model, inputs, explanation.beginning);
  warn_if_not_finite(arguments, "importances", explanation.shares);
  if (arguments.json) {
    print_json(report::explanation_json(model, explanation));
    return;
  }
  explanation.data = table_name(arguments.data);
  print(report::explanation_text(model, explanation, output_width()));
}

Attribution attribution_of(const Model& model, const Eigen::VectorXd& point, const Eigen::MatrixXd& /*inputs*/,
                           std::string& /*beginning*/) {
  return attribute(model, point);
}

Attribution attribution_of(const BoostedModel& model, const Eigen::VectorXd& point, const Eigen::MatrixXd& inputs,
                           std::string& beginning) {
  const Eigen::MatrixXd background = background_of(inputs, most_background);
  beginning = mean_over(background.rows());
  return attribute(model, point, background);
}

template <class AnyModel>
void explain_row(const ExplainArguments& arguments, const AnyModel& model, const Csv& csv,
                 const Eigen::MatrixXd& inputs) {
  if (arguments.row > inputs.rows()) {
    throw std::invalid_argument(
        fmt::format("--row is {}, {} has {} rows", arguments.row, table_name(arguments.data), inputs.rows()));
  }
  report::RowExplanation explanation{arguments.model,
                                     arguments.data,
                                     arguments.row,
                                     csv.line_of(arguments.row - 1),
                                     inputs.row(arguments.row - 1),
                                     {}};
  explanation.attribution = with_name(
      arguments.model, [&] { return attribution_of(model, explanation.inputs, inputs, explanation.beginning); });
  warn_if_not_finite(arguments, "contributions", explanation.attribution.contributions);
  if (arguments.json) {
    print_json(report::explanation_json(model, explanation));
    return;
  }
  explanation.data = table_name(arguments.data);
  print(report::explanation_text(model, explanation, output_width()));
}

template <class AnyModel>
void explain(const ExplainArguments& arguments, const AnyModel& model) {
  const Csv csv = read_table(arguments.data, arguments.mark, arguments.thousands);
  if (csv.rows() == 0) {
    throw std::runtime_error(fmt::format("{}: there is a header and no rows", arguments.data));
  }
  const Eigen::MatrixXd inputs = report::read_inputs(csv, model, arguments.threads).values;
  if (arguments.row > 0) {
    explain_row(arguments, model, csv, inputs);
  } else {
    explain_table(arguments, model, inputs);
  }
}

void explain_command(const ExplainArguments& arguments) {
  if (is_boosted_file(arguments.model)) {
    explain(arguments, load_boosted(arguments.model));
    return;
  }
  explain(arguments, read_unless_exchanged(arguments.model, arguments.data, model_comes_first,
                                           [](const std::string& path) { return load_model(path); }));
}

}  // namespace

void add_explain(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "explain",
      "Say which inputs a model's predictions come from\n"
      "Over a table: the importance of each input. For one row of it: how far each input moves the prediction away "
      "from the one at the means of the inputs; of a sum of trees, away from the mean prediction of the table.");
  command->footer("Example: llmt explain concrete.json concrete.csv --row 3");
  const auto arguments = std::make_shared<ExplainArguments>();
  add_input_file(*command, "model", arguments->model, "Model file of llmt fit")->required();
  add_input_file(*command, "data", arguments->data, "CSV file with the model's inputs; - is standard input")
      ->required();
  add_count(*command, "--row", arguments->row, Eigen::Index{1}, "Row to explain, the first one below the header is 1");
  add_decimal_comma(*command, arguments->mark);
  add_thousands(*command, arguments->thousands);
  add_threads(*command, arguments->threads);
  command->add_flag("--json", arguments->json, "Print JSON");
  command->callback([arguments] { explain_command(*arguments); });
}

}  // namespace llmt::apps
