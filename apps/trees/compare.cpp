#include "llmt/compare.hpp"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "llmt/csv.hpp"
#include "report/document/document_text.hpp"
#include "report/fit/comparison.hpp"
#include "shared/cli.hpp"
#include "shared/report_files.hpp"
#include "shared/table_file.hpp"
#include "trees/commands.hpp"
#include "trees/fit_options.hpp"
#include "trees/learning.hpp"

namespace llmt::apps {
namespace {

struct CompareArguments {
  LearningArguments learning;
  bool json = false;
  ReportFiles reports;
};

void compare_command(CompareArguments arguments) {
  require_target(arguments.learning);
  if (arguments.learning.targets.size() != 1) {
    throw std::invalid_argument("compare takes one --target");
  }
  if (arguments.learning.options.folds.count < 2) {
    throw std::invalid_argument("compare needs --cv 2 or more");
  }
  const LearningTable table = read_learning_table(arguments.learning);
  if (table.data->outputs.rows() < 2) {
    throw std::runtime_error(fmt::format("{}: one row leaves none to hold out", table_name(arguments.learning.data)));
  }
  CompareOptions options;
  options.folds = arguments.learning.options.folds;
  ProgressBar bar("fitting");
  options.progress = bar.callback();
  std::vector<Method> methods = usual_methods(table.options, *table.data);
  const std::string no_sum = why_not_boosted(table.options, *table.data);
  if (no_sum.empty()) methods.push_back(boosted_method(table.options));
  const ComparisonResult result = compare(*table.data, methods, options);
  bar.clear();
  const std::string& target = arguments.learning.targets.front();
  report::FitRun run{table_name(arguments.learning.data), table.options, *table.data, table.lines, ""};
  const report::Document document = report::comparison_report(run, target, result);
  const std::string reports = arguments.reports.wanted() ? write_reports(arguments.reports, document) : "";
  if (arguments.json) {
    run.data = arguments.learning.data;
    print_json(report::comparison_json(run, target, result));
    return;
  }
  print(report::document_text(document, output_width()));
  if (!no_sum.empty()) print(fmt::format("A sum of trees (--boost) is not compared: {}.\n", no_sum));
  print(reports);
}

}  // namespace

void add_compare(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("compare", "Compare smooth and discontinuous trees, and a sum of trees, on held-out rows");
  command->footer("Example: llmt compare concrete.csv --target strength");
  const auto arguments = std::make_shared<CompareArguments>();
  add_learning_options(*command, arguments->learning);
  add_fit_options(*command, arguments->learning.options, arguments->learning.columns, true);
  add_report_options(*command, arguments->reports, "the held-out error of every method");
  command->add_flag("--json", arguments->json, "Print JSON");
  command->callback([arguments] { compare_command(*arguments); });
}

}  // namespace llmt::apps
