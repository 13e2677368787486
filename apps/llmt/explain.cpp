#include "llmt/explain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <stdexcept>

#include "llmt/commands.hpp"
#include "llmt/csv.hpp"
#include "llmt/model.hpp"
#include "llmt/model_file.hpp"
#include "report/table/columns.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/table_file.hpp"

namespace llmt::apps {
namespace {

struct ExplainArguments {
  std::string model;
  std::string data;
  Eigen::Index row = 0;  // counted from 1; 0: the whole table
  DecimalMark mark = DecimalMark::point;
  bool json = false;
  int threads = 0;
};

// Inputs, the largest magnitude first; equal ones in the order of the columns.
std::vector<std::size_t> by_size(const Eigen::VectorXd& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order,
                           [&](std::size_t a, std::size_t b) { return std::abs(values(a)) > std::abs(values(b)); });
  return order;
}

void warn_if_not_finite(const ExplainArguments& arguments, const char* what, const Eigen::MatrixXd& values) {
  if (const Eigen::Index count = values.size() - values.array().isFinite().count(); count > 0) {
    warn(fmt::format("llmt: warning: {} of {} {} are not finite: numbers of {} are too large for these rows", count,
                     values.size(), what, arguments.model));
  }
}

void explain_table(const ExplainArguments& arguments, const Model& model, const Eigen::MatrixXd& inputs) {
  const Eigen::MatrixXd shares = importance(model, inputs, arguments.threads);
  warn_if_not_finite(arguments, "importances", shares);
  const Eigen::Index used = std::min(inputs.rows(), importance_rows);
  Json json = {{"model", arguments.model}, {"data", arguments.data}, {"rows", inputs.rows()}, {"rows_used", used}};
  json["targets"] = Json::array();
  if (!arguments.json) {
    print(fmt::format("{}: importance over {} of {} rows\n", table_name(arguments.data), used, inputs.rows()));
  }
  for (Eigen::Index o = 0; o < model.num_outputs(); ++o) {
    const std::string& target = model.outputs()[o].name;
    Table printed({"input", "importance"});
    Json entries = Json::array();
    for (const std::size_t j : by_size(shares.row(o))) {
      const double share = shares(o, j);
      printed.add({model.inputs()[j].name, fmt::format("{:.3f}", share)});
      entries.push_back({{"input", model.inputs()[j].name}, {"importance", share}});
    }
    json["targets"].push_back({{"name", target}, {"importance", std::move(entries)}});
    if (!arguments.json) {
      print(fmt::format("\n{}\n{}", target, printed.text(output_width())));
    }
  }
  if (arguments.json) {
    print_json(json);
  } else {
    print("\nMean share of each input in how far predictions lie from the one at the means of the inputs.\n");
  }
}

void explain_row(const ExplainArguments& arguments, const Model& model, const Csv& csv, const Eigen::MatrixXd& inputs) {
  if (arguments.row > inputs.rows()) {
    throw std::invalid_argument(
        fmt::format("--row is {}, {} has {} rows", arguments.row, table_name(arguments.data), inputs.rows()));
  }
  const Eigen::VectorXd point = inputs.row(arguments.row - 1);
  const Attribution attribution = attribute(model, point);
  warn_if_not_finite(arguments, "contributions", attribution.contributions);
  Json json = {{"model", arguments.model}, {"data", arguments.data}, {"row", arguments.row}};
  json["targets"] = Json::array();
  if (!arguments.json) {
    print(fmt::format("{}: row {}, line {} of the file\n", table_name(arguments.data), arguments.row,
                      csv.line_of(arguments.row - 1)));
  }
  for (Eigen::Index o = 0; o < model.num_outputs(); ++o) {
    const std::string& target = model.outputs()[o].name;
    Table printed({"input", "value", "contribution"});
    Json entries = Json::array();
    for (const std::size_t j : by_size(attribution.contributions.row(o))) {
      const double value = point(j);
      const double contribution = attribution.contributions(o, j);
      const InputColumn& input = model.inputs()[j];
      const bool known = !std::isnan(value);
      const bool is_word = input.is_categorical() && input.codes.empty();
      const std::string level = known && is_word ? input.levels[static_cast<std::size_t>(value)] : "";
      const std::string shown = !known ? "missing" : is_word ? level : number(value);
      printed.add({input.name, shown, number(contribution)});
      entries.push_back({{"input", input.name},
                         {"value", !known    ? Json(nullptr)
                                   : is_word ? Json(level)
                                             : Json(value)},
                         {"contribution", contribution}});
    }
    json["targets"].push_back({{"name", target},
                               {"prediction", attribution.prediction(o)},
                               {"reference", attribution.reference(o)},
                               {"contributions", std::move(entries)}});
    if (!arguments.json) {
      print(fmt::format("\n{}: {} here, {} at the means of the inputs\n{}", target,
                        number(attribution.prediction(o), 6), number(attribution.reference(o), 6),
                        printed.text(output_width())));
      const double sum = attribution.contributions.row(o).sum();
      print(fmt::format("The contributions add up: {} {} {} = {}\n", number(attribution.reference(o), 6),
                        sum < 0.0 ? "-" : "+", number(std::abs(sum), 6), number(attribution.prediction(o), 6)));
    }
  }
  if (arguments.json) {
    print_json(json);
  }
}

void explain_command(const ExplainArguments& arguments) {
  const Model model = read_unless_exchanged(arguments.model, arguments.data, model_comes_first,
                                            [](const std::string& path) { return load_model(path); });
  const Csv csv = read_table(arguments.data, arguments.mark);
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

}  // namespace

void add_explain(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "explain",
      "Say which inputs a model's predictions come from\n"
      "Over a table: the importance of each input. For one row of it: how far each input moves the prediction away "
      "from the one at the means of the inputs.");
  command->footer("Example: llmt explain concrete.json concrete.csv --row 3");
  const auto arguments = std::make_shared<ExplainArguments>();
  add_input_file(*command, "model", arguments->model, "Model file of llmt fit")->required();
  add_input_file(*command, "data", arguments->data, "CSV file with the model's inputs; - is standard input")
      ->required();
  add_count(*command, "--row", arguments->row, Eigen::Index{1}, "Row to explain, the first one below the header is 1");
  add_decimal_comma(*command, arguments->mark);
  add_threads(*command, arguments->threads);
  command->add_flag("--json", arguments->json, "Print JSON");
  command->callback([arguments] { explain_command(*arguments); });
}

}  // namespace llmt::apps
