#include <memory>

#include "llmt/commands.hpp"
#include "llmt/fit.hpp"
#include "llmt/fit_options.hpp"
#include "llmt/fit_summary.hpp"
#include "llmt/learning.hpp"
#include "llmt/stream_command.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

struct FitArguments {
  LearningArguments learning;
  std::string output;
  bool json = false;
  bool no_intervals = false;
  bool stream = false;
};

void fit_command(FitArguments arguments) {
  LearningTable table = read_learning_table(arguments.learning);
  Progress progress("growing trees");
  table.options.intervals = !arguments.no_intervals && !arguments.output.empty();
  table.options.progress = [&](Eigen::Index done, Eigen::Index total) { progress.show(done, total); };
  FitResult result = fit(table.inputs.values, table.outputs, table.options);
  progress.clear();
  result.model = result.model.named(table.names, arguments.learning.targets, table.inputs.levels);
  if (!arguments.output.empty()) {
    save(result.model, result.intervals, arguments.output);
  }
  if (arguments.json) {
    print_json(summary_json({arguments.learning, arguments.output}, result));
  } else {
    print_summary({arguments.learning, arguments.output}, result);
  }
}

}  // namespace

void add_fit(CLI::App& app) {
  CLI::App* command = app.add_subcommand("fit", "Learn a model from a table");
  command->footer("Example: llmt fit concrete.csv --target strength -o concrete.json");
  const auto arguments = std::make_shared<FitArguments>();
  add_learning_options(*command, arguments->learning);
  add_fit_options(*command, arguments->learning.options);
  add_output_file(*command, "-o,--output", arguments->output, "Model file to write");
  command->add_flag("--no-intervals", arguments->no_intervals,
                    "Leave the folds' models out of the file; it is smaller and has no prediction intervals");
  command->add_flag("--json", arguments->json, "Print the summary as JSON");
  command->add_flag("--stream", arguments->stream, "Learn row by row in constant memory; DATA - is standard input");
  command->callback([command, arguments] {
    if (arguments->stream) {
      stream_command(*command, {arguments->learning, arguments->output, arguments->json});
      return;
    }
    fit_command(*arguments);
  });
}

}  // namespace llmt::apps
