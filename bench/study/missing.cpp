// Coverage of prediction intervals, complete rows and rows with an empty cell apart, beside that of intervals which
// calibrate all rows together.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <vector>

#include "llmt/random.hpp"
#include "methods.hpp"
#include "study/study.hpp"
#include "synthetic.hpp"

namespace bench {
namespace {

constexpr double nominal = 0.9;  // level of the intervals

// Rows inside their interval, of how many.
struct Share {
  Eigen::Index inside = 0;
  Eigen::Index rows = 0;

  double value() const { return static_cast<double>(inside) / static_cast<double>(rows); }
};

struct Coverage {
  Share complete;
  Share incomplete;
};

// Empties one cell, chosen at random, in the given share of the rows.
void empty_cells(Eigen::MatrixXd& inputs, double share, llmt::Random& random) {
  for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
    if (random.uniform() >= share) continue;
    const auto column = static_cast<Eigen::Index>(random.below(static_cast<std::uint64_t>(inputs.cols())));
    inputs(row, column) = std::numeric_limits<double>::quiet_NaN();
  }
}

// As if all held-out rows were of one kind.
llmt::Intervals pooled(const llmt::Intervals& intervals) {
  std::vector<llmt::HeldOutPart> parts = intervals.parts();
  for (llmt::HeldOutPart& part : parts) {
    Eigen::MatrixXd all(part.residuals.rows() + part.incomplete.rows(), part.residuals.cols());
    all << part.residuals, part.incomplete;
    part.residuals = std::move(all);
    part.incomplete.resize(0, part.residuals.cols());
  }
  return {intervals.models(), std::move(parts)};
}

void count(const llmt::Intervals& intervals, const Trial& trial, Coverage& sum) {
  const llmt::Bounds bounds = intervals.predict(trial.test_inputs, nominal);
  for (Eigen::Index row = 0; row < trial.test_output.size(); ++row) {
    Share& share = trial.test_inputs.row(row).hasNaN() ? sum.incomplete : sum.complete;
    const double output = trial.test_output(row);
    share.inside += output >= bounds.lower(row, 0) && output <= bounds.upper(row, 0) ? 1 : 0;
    ++share.rows;
  }
}

void run(const Task& task, double share) {
  Coverage together;
  Coverage apart;
  for (int t = 0; t < task.trials; ++t) {
    Trial trial = task.trial(t);
    llmt::Random random(static_cast<std::uint64_t>(t) + 1);
    empty_cells(trial.train_inputs, share, random);
    empty_cells(trial.test_inputs, share, random);
    const llmt::FitResult fit = llmt::fit(trial.train_inputs, trial.train_output, {.max_threads = 0});
    count(pooled(fit.intervals), trial, together);
    count(fit.intervals, trial, apart);
  }
  fmt::print("{:12} {:10} {:10} {:14.3f} {:14.3f} {:14.3f} {:14.3f}\n", task.name, apart.complete.rows,
             apart.incomplete.rows, together.complete.value(), together.incomplete.value(), apart.complete.value(),
             apart.incomplete.value());
  std::fflush(stdout);
}

// The function of synthetic.hpp in ten inputs, 2000 rows; the outputs of its test rows have noise too.
Task simulated(int trials) {
  return {"simulated", {}, trials, [](int t) {
            const Sample train = sample(2000, 10, 2 * static_cast<std::uint64_t>(t) + 1);
            const Sample test = sample(5000, 10, 2 * static_cast<std::uint64_t>(t) + 2);
            return Trial{train.x, train.y, test.x, test.y};
          }};
}

}  // namespace

void add_missing(CLI::App& study) {
  const auto choice = std::make_shared<TaskChoice>();
  const auto share = std::make_shared<double>(0.07);
  CLI::App* command =
      study.add_subcommand("missing", "Coverage of 90 % intervals of rows with and without empty cells");
  add_task_options(*command, *choice);
  command->add_option("--share", *share, "Share of the rows that have an empty cell")->capture_default_str();
  command->callback([choice, share] {
    fmt::print("{:12} {:>10} {:>10} {:>29} {:>29}\n", "", "test rows", "", "all rows together, inside",
               "apart, inside");
    fmt::print("{:12} {:>10} {:>10} {:>14} {:>14} {:>14} {:>14}\n", "data", "complete", "incomplete", "complete",
               "incomplete", "complete", "incomplete");
    if (choice->folder.empty()) {
      run(simulated(choice->trials), *share);
      return;
    }
    for (const Task& task : chosen_tasks(*choice)) run(task, *share);
  });
}

}  // namespace bench
