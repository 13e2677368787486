#include <fmt/format.h>

#include <optional>
#include <stdexcept>
#include <utility>

#include "llmt/boosted.hpp"
#include "llmt/time_limit.hpp"
#include "report/fit/boosted_summary.hpp"
#include "report/fit/mean_of_rows.hpp"
#include "shared/cli.hpp"
#include "shared/table_file.hpp"
#include "trees/boost_command.hpp"

namespace llmt::apps {
void boost_command(const CLI::App& command, const BoostArguments& arguments) {
  refuse_options(command, boosting);
  const LearningTable table = read_learning_table(arguments.learning);
  if (const Eigen::Index rows = table.data->outputs.rows(); rows < fewest_boosted_rows) {
    throw std::runtime_error(
        fmt::format("{}: {} row{}; --boost needs at least {} that differ, llmt fit without --boost takes fewer",
                    table_name(arguments.learning.data), rows, rows == 1 ? "" : "s", fewest_boosted_rows));
  }
  const BoostOptions options{.max_rounds = arguments.max_rounds,
                             .seed = table.options.folds.seed,
                             .seeds = arguments.seeds,
                             .max_threads = table.options.max_threads};
  ProgressBar bar("boosting");
  std::optional<TimeLimit> time;
  const BoostResult result = [&] {
    if (arguments.time_limit == 0.0) return fit_boosted(*table.data, options, bar.callback());
    TimedSum timed = fit_boosted_within(arguments.time_limit, *table.data, options, bar.callback());
    time = timed.time;
    return std::move(timed.result);
  }();
  bar.clear();
  if (!arguments.output.empty()) save(result.model, arguments.output);
  report::BoostedRun run{table_name(arguments.learning.data), arguments.output, {}, time};
  for (const auto& output : table.data->outputs.colwise()) {
    run.rmse_of_mean.push_back(report::error_of_mean(output, table.data->weights, {}).train);
  }
  if (arguments.json) {
    print_json(report::boosted_json(run, result));
    return;
  }
  print(report::boosted_text(run, result, output_width()));
  print(arguments.output.empty() ? "Not written: give -o FILE.json\n"
                                 : fmt::format("Model written to {}\n", arguments.output));
}

}  // namespace llmt::apps
