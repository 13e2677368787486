// Tables in which rows stand more than once: test errors with every training row written twice and three times, and,
// for a bootstrap sample of the training rows, the reported held-out error beside the error on the rows left over.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <vector>

#include "llmt/random.hpp"
#include "methods.hpp"
#include "study/study.hpp"

namespace bench {
namespace {

constexpr double nominal = 0.9;  // level of the intervals

// Means over the trials.
struct Result {
  double once = 0.0;  // test RMSE
  double twice = 0.0;
  double three_times = 0.0;
  double covered_twice = 0.0;  // share of test rows in their interval
  double reported = 0.0;       // held-out RMSE of the bootstrap sample
  double out_of_bag = 0.0;     // RMSE on the rows that are not in the sample
};

using Rows = std::vector<Eigen::Index>;

llmt::FitResult fit_rows(const Trial& trial, const Rows& rows) {
  return llmt::fit(trial.train_inputs(rows, Eigen::all), trial.train_output(rows), {.max_threads = 0});
}

double test_rmse(const llmt::FitResult& fit, const Trial& trial) {
  return llmt::rmse(fit.model.predict(trial.test_inputs), trial.test_output)(0);
}

// Every row `times` times, the whole table after itself.
Rows repeated(Eigen::Index rows, Eigen::Index times) {
  Rows result(static_cast<std::size_t>(rows * times));
  for (std::size_t k = 0; k < result.size(); ++k) result[k] = static_cast<Eigen::Index>(k) % rows;
  return result;
}

void add_bootstrap(const Trial& trial, std::uint64_t seed, double part, Result& sum) {
  llmt::Random random(seed);
  const Eigen::Index count = trial.train_output.size();
  Rows sample(static_cast<std::size_t>(count));
  std::vector<bool> drawn(sample.size(), false);
  for (Eigen::Index& row : sample) {
    row = static_cast<Eigen::Index>(random.below(static_cast<std::uint64_t>(count)));
    drawn[static_cast<std::size_t>(row)] = true;
  }
  Rows left;
  for (Eigen::Index row = 0; row < count; ++row) {
    if (!drawn[static_cast<std::size_t>(row)]) left.push_back(row);
  }
  const llmt::FitResult fit = fit_rows(trial, sample);
  const Eigen::VectorXd truth = trial.train_output(left);
  sum.out_of_bag += part * llmt::rmse(fit.model.predict(trial.train_inputs(left, Eigen::all)), truth)(0);
  sum.reported += part * fit.summary.partitions[0].chosen.rmse;
}

Result run(const Task& task) {
  Result sum;
  const double part = 1.0 / task.trials;
  for (int t = 0; t < task.trials; ++t) {
    const Trial trial = task.trial(t);
    const Eigen::Index rows = trial.train_output.size();
    sum.once += part * test_rmse(fit_rows(trial, repeated(rows, 1)), trial);
    const llmt::FitResult twice = fit_rows(trial, repeated(rows, 2));
    sum.twice += part * test_rmse(twice, trial);
    const llmt::Bounds bounds = twice.intervals.predict(trial.test_inputs, nominal);
    const auto output = trial.test_output.array();
    const auto inside = output >= bounds.lower.col(0).array() && output <= bounds.upper.col(0).array();
    sum.covered_twice += part * static_cast<double>(inside.count()) / static_cast<double>(output.size());
    sum.three_times += part * test_rmse(fit_rows(trial, repeated(rows, 3)), trial);
    add_bootstrap(trial, static_cast<std::uint64_t>(t) + 1, part, sum);
  }
  return sum;
}

}  // namespace

void add_repeats(CLI::App& study) {
  const auto choice = std::make_shared<TaskChoice>();
  CLI::App* command = study.add_subcommand("repeats", "Rows written twice and three times, and bootstrap samples");
  add_task_options(*command, *choice);
  command->callback([choice] {
    fmt::print("{:12} {:>12} {:>8} {:>12} {:>16} {:>12} {:>12} {:>8}\n", "data", "once", "twice", "three times",
               "covered, twice", "bootstrap", "out of bag", "ratio");
    for (const Task& task : chosen_tasks(*choice)) {
      const Result result = run(task);
      fmt::print("{:12} {:12.5g} {:8.4f} {:12.4f} {:16.4f} {:12.5g} {:12.5g} {:8.3f}\n", task.name, result.once,
                 result.twice / result.once, result.three_times / result.once, result.covered_twice, result.reported,
                 result.out_of_bag, result.reported / result.out_of_bag);
      std::fflush(stdout);
    }
  });
}

}  // namespace bench
