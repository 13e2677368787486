#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>

#include "llmt/boosted.hpp"
#include "report/fit/boosted_summary.hpp"
#include "shared/cli.hpp"
#include "shared/table_file.hpp"
#include "trees/boost_command.hpp"

namespace llmt::apps {
namespace {

void refuse_options_of_one_tree(const CLI::App& command) {
  constexpr std::array<std::string_view, 13> taken = {"data",   "target",  "inputs", "ignore",        "categorical",
                                                      "weight", "output",  "json",   "decimal-comma", "thousands",
                                                      "boost",  "threads", "seed"};
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = option->get_single_name();
    if (option->count() > 0 && std::ranges::find(taken, name) == taken.end()) {
      throw std::invalid_argument(fmt::format("--{} is not for --boost; one tree takes it", name));
    }
  }
}

}  // namespace

void boost_command(const CLI::App& command, const BoostArguments& arguments) {
  refuse_options_of_one_tree(command);
  const LearningTable table = read_learning_table(arguments.learning);
  if (const Eigen::Index rows = table.data->outputs.rows(); rows < fewest_boosted_rows) {
    throw std::runtime_error(
        fmt::format("{}: {} row{}; --boost needs at least {} that differ, llmt fit without --boost takes fewer",
                    table_name(arguments.learning.data), rows, rows == 1 ? "" : "s", fewest_boosted_rows));
  }
  const BoostOptions options{.seed = table.options.folds.seed, .max_threads = table.options.max_threads};
  ProgressBar bar("boosting");
  const BoostResult result = fit_boosted(*table.data, options, bar.callback());
  bar.clear();
  if (!arguments.output.empty()) save(result.model, arguments.output);
  const report::BoostedRun run{table_name(arguments.learning.data), arguments.output};
  if (arguments.json) {
    print_json(report::boosted_json(run, result));
    return;
  }
  print(report::boosted_text(run, result, output_width()));
  print(arguments.output.empty() ? "Not written: give -o FILE.json\n"
                                 : fmt::format("Model written to {}\n", arguments.output));
}

}  // namespace llmt::apps
