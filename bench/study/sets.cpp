// Test error of one tree with default options, or with other local models, beside least squares: mean test RMSE over
// the trials of each task, and the share of test rows in the intervals of nominal 90 %, CV+ and split conformal (which
// uses the first fold alone), with the intervals' mean widths.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>

#include "methods.hpp"
#include "resources.hpp"
#include "study/study.hpp"

namespace bench {
namespace {

// Means over the trials.
struct Held {
  double share = 0.0;  // of the test rows that lie in their interval
  double width = 0.0;
};

struct Result {
  double tree = 0.0;           // RMSE
  double least_squares = 0.0;  // RMSE
  double worst_ratio = 0.0;    // largest tree / least squares of a trial
  double leaves = 0.0;
  double coefficients = 0.0;
  int quadratic = 0;  // trials that took quadratic local models
  int sparse = 0;
  double seconds = 0.0;  // wall, per fit
  Held cv_plus;
  Held split_conformal;
};

Held held(const llmt::Intervals& intervals, const Trial& trial) {
  const llmt::Bounds bounds = intervals.predict(trial.test_inputs, 0.9);
  const auto output = trial.test_output.array();
  const auto inside = output >= bounds.lower.col(0).array() && output <= bounds.upper.col(0).array();
  return {static_cast<double>(inside.count()) / static_cast<double>(output.size()),
          (bounds.upper - bounds.lower).mean()};
}

double test_rmse(const llmt::Model& model, const Trial& trial) {
  return llmt::rmse(model.predict(trial.test_inputs), trial.test_output)(0);
}

void add(Held& sum, double part, const Held& held) {
  sum.share += part * held.share;
  sum.width += part * held.width;
}

Result run(const Task& task, const llmt::FitOptions& options) {
  Result sum;
  for (int t = 0; t < task.trials; ++t) {
    const Trial trial = task.trial(t);
    std::optional<llmt::FitResult> fit;
    sum.seconds += measure([&] { fit = llmt::fit(trial.train_inputs, trial.train_output, options); }).wall;
    const double tree = test_rmse(fit->model, trial);
    const double linear = test_rmse(llmt::fit(trial.train_inputs, trial.train_output, least_squares()).model, trial);
    const llmt::Intervals first_fold({fit->intervals.models()[0]},
                                     std::vector<llmt::HeldOutPart>{fit->intervals.parts()[0]});
    add(sum.cv_plus, 1.0 / task.trials, held(fit->intervals, trial));
    add(sum.split_conformal, 1.0 / task.trials, held(first_fold, trial));
    sum.tree += tree;
    sum.least_squares += linear;
    sum.worst_ratio = std::max(sum.worst_ratio, tree / linear);
    const llmt::PartitionSummary& partition = fit->summary.partitions[0];
    sum.leaves += static_cast<double>(partition.leaves);
    sum.coefficients += static_cast<double>(partition.coefficients);
    sum.quadratic += fit->summary.quadratic ? 1 : 0;
    sum.sparse += partition.chosen.candidate.sparse ? 1 : 0;
  }
  for (double* value : {&sum.tree, &sum.least_squares, &sum.leaves, &sum.coefficients, &sum.seconds}) {
    *value /= task.trials;
  }
  return sum;
}

struct Arguments {
  TaskChoice tasks;
  llmt::FitOptions options;
};

void study_sets(const Arguments& arguments) {
  fmt::print("{:12} {:>14} {:>14} {:>18} {:>8} {:>12} {:>16} {:>10} {:>10} {:>10} {:>12} {:>10}\n", "data",
             "least squares", "llmt", "worst split, ratio", "leaves", "coefficients", "quadratic/sparse", "s per fit",
             "CV+ 90 %", "width", "split conf.", "width");
  for (const Task& task : chosen_tasks(arguments.tasks)) {
    const Result result = run(task, arguments.options);
    fmt::print(
        "{:12} {:14.5g} {:14.5g} {:18.3f} {:8.1f} {:12.1f} {:>16} {:10.3f} {:10.4f} {:10.4g} {:12.4f} {:10.4g}\n",
        task.name, result.least_squares, result.tree, result.worst_ratio, result.leaves, result.coefficients,
        fmt::format("{}/{}", result.quadratic, result.sparse), result.seconds, result.cv_plus.share,
        result.cv_plus.width, result.split_conformal.share, result.split_conformal.width);
    std::fflush(stdout);
  }
}

}  // namespace

void add_sets(CLI::App& study) {
  using llmt::LocalTerms;
  using llmt::SparseChoice;
  using llmt::ValidityChoice;
  const std::map<std::string, LocalTerms> terms = {
      {"linear", LocalTerms::linear}, {"quadratic", LocalTerms::quadratic}, {"auto", LocalTerms::automatic}};
  const std::map<std::string, SparseChoice> sparse = {
      {"never", SparseChoice::never}, {"auto", SparseChoice::automatic}, {"always", SparseChoice::always}};
  const std::map<std::string, ValidityChoice> validity = {{"auto", ValidityChoice::automatic},
                                                          {"crisp", ValidityChoice::crisp}};
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = study.add_subcommand("sets", "One tree beside least squares");
  add_task_options(*command, arguments->tasks);
  // The options of `llmt fit`.
  command->add_option("--local-models", arguments->options.terms, "linear, quadratic or auto")
      ->transform(CLI::CheckedTransformer(terms));
  command->add_option("--sparse", arguments->options.sparse, "never, auto or always")
      ->transform(CLI::CheckedTransformer(sparse));
  command->add_option("--validity", arguments->options.validity, "auto or crisp")
      ->transform(CLI::CheckedTransformer(validity));
  command->callback([arguments] { study_sets(*arguments); });
}

}  // namespace bench
