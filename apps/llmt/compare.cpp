#include "llmt/compare.hpp"

#include <fmt/format.h>

#include <memory>

#include "llmt/commands.hpp"
#include "llmt/csv.hpp"
#include "llmt/fit_options.hpp"
#include "llmt/fit_summary.hpp"
#include "llmt/learning.hpp"
#include "report/of_comparison.hpp"
#include "report/options.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

struct CompareArguments {
  LearningArguments learning;
  bool json = false;
  ReportFiles reports;
};

Json comparison_json(const CompareArguments& arguments, const LearningTable& table, const ComparisonResult& result) {
  Json json;
  json["data"] = arguments.learning.data;
  json["rows"] = table.inputs.values.rows();
  json["target"] = arguments.learning.targets.front();
  json["folds"] = result.methods.front().fold_rmse.size();
  json["methods"] = Json::array();
  for (const Comparison& method : result.methods) {
    json["methods"].push_back({{"method", method.method},
                               {"leaves", method.leaves},
                               {"parameters", method.parameters},
                               {"cv_rmse", method.cv_rmse},
                               {"spread", method.spread},
                               {"fold_rmse", std::vector<double>(method.fold_rmse.begin(), method.fold_rmse.end())},
                               {"largest_jump", method.largest_jump},
                               {"fit_seconds", method.fit_seconds},
                               {"predict_seconds_per_million_rows", method.predict_seconds}});
  }
  if (arguments.learning.options.loss == Loss::tukey) {
    const std::vector<Eigen::Index> rows = rows_left_out(result.loss_weights, table.options.weights);
    json["rows_left_out"] = counted_from_one(rows);
    json["lines_left_out"] = lines_at(table, rows);
  }
  json["recommended"] = result.methods[result.recommended].method;
  json["recommendation"] = result.recommendation;
  return json;
}

void compare_command(CompareArguments arguments) {
  require_target(arguments.learning);
  if (arguments.learning.targets.size() != 1) {
    throw std::invalid_argument("compare takes one --target");
  }
  if (arguments.learning.options.folds.count < 2) {
    throw std::invalid_argument("compare needs --cv 2 or more");
  }
  const LearningTable table = read_learning_table(arguments.learning);
  if (table.outputs.rows() < 2) {
    throw std::runtime_error(fmt::format("{}: one row leaves none to hold out", table_name(arguments.learning.data)));
  }
  CompareOptions options;
  options.folds = arguments.learning.options.folds;
  ProgressBar bar("fitting");
  options.progress = bar.callback();
  const ComparisonResult result =
      compare(table.inputs.values, table.outputs, usual_methods(table.options, table.inputs.values.cols()), options);
  bar.clear();
  std::string reports;
  if (arguments.reports.wanted()) {
    reports = write_reports(
        arguments.reports, report::comparison_report({arguments.learning.data, arguments.learning.targets.front(),
                                                      table.inputs.values.rows(), table.inputs.values.cols(), result}));
  }
  if (arguments.json) {
    print_json(comparison_json(arguments, table, result));
    return;
  }
  print(fmt::format("{}: {} rows, {} inputs; {}, {} folds{}, every choice made inside the fold\n\n",
                    table_name(arguments.learning.data), table.inputs.values.rows(), table.names.size(),
                    arguments.learning.targets.front(), result.methods.front().fold_rmse.size(),
                    arguments.learning.contiguous ? " of contiguous rows" : ""));
  if (arguments.learning.options.loss == Loss::tukey) {
    const std::vector<Eigen::Index> rows = rows_left_out(result.loss_weights, table.options.weights);
    const Eigen::VectorXd& weights = table.options.weights;
    const Eigen::Index weighted = weights.size() > 0 ? (weights.array() > 0.0).count() : table.outputs.rows();
    print(left_out_by_loss(lines_at(table, rows), weighted) + "\n");
  }
  Table text({"method", "leaves", "parameters", "RMSE held-out", "spread of folds", "largest jump", "fit, s",
              "predict 1e6 rows, s"});
  for (const Comparison& method : result.methods) {
    text.add({method.method, fmt::format("{}", method.leaves), fmt::format("{}", method.parameters),
              number(method.cv_rmse), number(method.spread, 2), number(method.largest_jump, 3),
              number(method.fit_seconds, 2), number(method.predict_seconds, 2)});
  }
  print(text.text());
  print("\n" + result.recommendation + "\n" + reports);
}

}  // namespace

void add_compare(CLI::App& app) {
  CLI::App* command = app.add_subcommand("compare", "Compare smooth and discontinuous trees on held-out rows");
  command->footer("Example: llmt compare concrete.csv --target strength");
  const auto arguments = std::make_shared<CompareArguments>();
  add_learning_options(*command, arguments->learning);
  add_loss(*command, arguments->learning.options.loss);
  add_report_options(*command, arguments->reports, "the held-out error of every method");
  command->add_flag("--json", arguments->json, "Print JSON");
  command->callback([arguments] { compare_command(*arguments); });
}

}  // namespace llmt::apps
