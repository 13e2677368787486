// What pruning by the weakest link, and growth without the F test, do to held-out errors, leaves and time: means over
// the trials of each task.
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "llmt/fit.hpp"
#include "resources.hpp"
#include "study/study.hpp"

namespace bench {
namespace {

using llmt::Pruning;
using llmt::ValidityChoice;

struct Variant {
  ValidityChoice validity = ValidityChoice::crisp;
  Pruning pruning = Pruning::last_splits;
  double significance = -1.0;  // as in FitOptions: negative: the default, 1: no test
};

constexpr Variant variants[] = {{},
                                {.significance = 1.0},
                                {.pruning = Pruning::weakest_link},
                                {.validity = ValidityChoice::blend},
                                {.validity = ValidityChoice::blend, .pruning = Pruning::weakest_link}};

llmt::FitOptions options_of(const Variant& variant) {
  llmt::FitOptions options;
  options.validity = variant.validity;
  options.significance = variant.significance;
  options.pruning = variant.pruning;
  options.intervals = false;
  return options;
}

void study_variant(const Task& task, const Variant& variant) {
  double error = 0.0, held_out = 0.0, leaves = 0.0, seconds = 0.0;
  const double part = 1.0 / task.trials;
  for (int t = 0; t < task.trials; ++t) {
    const Trial trial = task.trial(t);
    std::optional<llmt::FitResult> fit;
    const Cost cost = measure([&] { fit = llmt::fit(trial.train_inputs, trial.train_output, options_of(variant)); });
    const llmt::PartitionSummary& summary = fit->summary.partitions.front();
    seconds += part * cost.wall;
    error += part * llmt::rmse(fit->model.predict(trial.test_inputs), trial.test_output)(0);
    held_out += part * summary.chosen.rmse;
    leaves += part * static_cast<double>(summary.leaves);
  }
  // The defaults of blends and of pruning have no F test.
  const bool crisp = variant.validity == ValidityChoice::crisp;
  const bool tested = crisp && variant.significance < 0.0 && variant.pruning == Pruning::last_splits;
  fmt::print("{:10} {:6} {:8} {:13} {:10.5g} {:10.5g} {:8.1f} {:8.2f}\n", task.name, crisp ? "crisp" : "blend",
             tested ? "F test" : "no test", variant.pruning == Pruning::weakest_link ? "weakest link" : "last splits",
             error, held_out, leaves, seconds);
  std::fflush(stdout);
}

}  // namespace

void add_pruning(CLI::App& study) {
  const auto choice = std::make_shared<TaskChoice>();
  CLI::App* command = study.add_subcommand("pruning", "Growth with and without F test and weakest-link pruning");
  add_task_options(*command, *choice);
  command->callback([choice] {
    fmt::print("{:10} {:6} {:8} {:13} {:>10} {:>10} {:>8} {:>8}\n", "data", "", "growth", "pruning", "test RMSE",
               "CV RMSE", "leaves", "s");
    for (const Task& task : chosen_tasks(*choice)) {
      for (const Variant& variant : variants) study_variant(task, variant);
    }
  });
}

}  // namespace bench
