#include "fit/choices/input_choice.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

#include "base/parallel.hpp"
#include "data/fewer_inputs.hpp"
#include "fit/plan/cheap_plan.hpp"
#include "fit/trees/grow_tree.hpp"
#include "fit/trees/held_out_error.hpp"
#include "llmt/explain.hpp"

namespace llmt {
namespace {

// No smaller number is tried once the error is this multiple of the smallest. Errors rise and fall on the way.
constexpr double largest_ratio = 1.2;

// With more rows for each input than this, coefficients of useless inputs cost too little to look for them.
constexpr Eigen::Index most_rows_per_input = 300;

// Share of the work that is left for each number of inputs.
constexpr double share_of_step = 0.1;

// Rows that importance looks at.
constexpr Eigen::Index ranking_rows = 300;

bool may_leave_out(const Training& training) {
  const Plan plan = plan_of(training);
  const Candidates& candidates = plan.candidates;
  const Table& table = *training.table;
  const auto inputs = std::ssize(table.split_inputs);
  const bool is_usual = !plan.rule->has_own_models && plan.rule->overlapping == ValidityKind::blend &&
                        (candidates.widths.empty() || candidates.kind == ValidityKind::blend);
  return training.options.choose_inputs && training.options.max_leaves != 1 && is_usual &&
         (training.folds.size() > 1 || training.kept->is_fold_given) && inputs > 1 &&
         table.split_inputs == table.regression_inputs && table.monotone.empty() &&
         training.all.count() < most_rows_per_input * inputs;
}

// The predictions' dependence on each of the model's inputs, summed over the outputs.
Eigen::VectorXd importance_of(const TrainingRows& rows, Partition partition, int max_threads) {
  std::vector<OutputColumn> outputs;
  for (const int output : partition.outputs) outputs.push_back(rows.output_columns[output]);
  std::iota(partition.outputs.begin(), partition.outputs.end(), 0);
  const Model model(rows.columns, std::move(outputs), rows.regressors, {std::move(partition)});
  const TrainingRows some = subsample(rows, ranking_rows);
  return importance(model, rows.table->inputs(some.rows, Eigen::all), max_threads).colwise().sum();
}

// Estimates the candidate of a step on a grown tree, and keeps the next number of inputs.
std::vector<int> next_inputs(const TrainingRows& rows, const std::vector<int>& inputs, const GrownTree& grown,
                             std::optional<Partition> made, Candidate candidate, Eigen::Index count, int max_threads,
                             Work& work) {
  if (!made) {
    candidate.leaves = std::min(candidate.leaves, grown.partition.num_leaves());
    made = estimate(rows, grown, candidate, max_threads, work);
  }
  return most_important(inputs, importance_of(rows, std::move(*made), max_threads), count);
}

// A number of inputs on the way.
struct Step {
  std::vector<std::vector<int>> of_folds;
  CandidateError chosen;

  Eigen::Index inputs() const { return std::ssize(of_folds.front()); }
};

class BackwardElimination {
 public:
  BackwardElimination(const Training& training, const std::vector<int>& served, Work& work)
      : training_(training), served_(served), work_(work) {}

  // Compares numbers of inputs, largest first, each fold's inputs ranked on its training rows.
  std::vector<Step> compare() const {
    std::vector<Step> steps;
    const std::vector<int>& every = training_.all.split_inputs;
    std::vector<std::vector<int>> of_folds(training_.folds.size(), every);
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index size = std::ssize(every); size >= 1; size = fewer_inputs(size)) {
      const Training training = narrowed(training_, of_folds.front(), of_folds);
      Work step(work_, share_of_step * work_.left());
      HeldOutFits fits = held_out_error(training, cheap_plan(training), served_, step);
      const CandidateError& chosen = fits.selection.chosen;
      steps.push_back({of_folds, chosen});
      least = std::min(least, chosen.rmse);
      if (size == 1 || chosen.rmse > largest_ratio * least) return steps;
      fits.selection.made.resize(of_folds.size());
      parallel_for(std::ssize(of_folds), threads(), [&](Eigen::Index f) {
        of_folds[f] = next_inputs(training.folds[f].training, of_folds[f], fits.trees[f],
                                  std::move(fits.selection.made[f]), chosen.candidate, fewer_inputs(size), 1, work_);
      });
    }
    return steps;
  }

  // The inputs of the last of some steps, ranked on all rows.
  std::vector<int> repeat(std::span<const Step> steps) const {
    std::vector<int> inputs = training_.all.split_inputs;
    for (const Step& step : steps.first(steps.size() - 1)) {
      const std::vector<std::vector<int>> of_folds(training_.folds.size(), inputs);
      const Training training = narrowed(training_, inputs, of_folds);
      Work tree(work_, share_of_step * work_.left() / static_cast<double>(of_folds.size()));
      const FinalTree grown = grow_tree(training.all, served_, cheap_plan(training), false, threads(), tree);
      inputs = next_inputs(training.all, inputs, grown.tree, {}, step.chosen.candidate, fewer_inputs(step.inputs()),
                           threads(), work_);
    }
    return inputs;
  }

 private:
  int threads() const { return training_.options.max_threads; }

  const Training& training_;
  const std::vector<int>& served_;
  Work& work_;
};

}  // namespace

ChosenInputs choose_inputs(const std::shared_ptr<const Training>& training, const std::vector<int>& served,
                           Work& work) {
  ChosenInputs result{training};
  if (!may_leave_out(*training)) return result;
  const BackwardElimination elimination(*training, served, work);
  const std::vector<Step> steps = elimination.compare();
  for (const Step& step : steps) result.steps.push_back({step.inputs(), step.chosen.rmse});
  const auto best = std::ranges::min_element(steps, {}, [](const Step& step) { return step.chosen.rmse; });
  if (!is_beyond_chance(steps.front().chosen, best->chosen)) return result;
  // A fold that the caller holds out trains on the rows of the model.
  const std::vector<int> of_all =
      training->kept->is_fold_given ? best->of_folds.front() : elimination.repeat({steps.begin(), best + 1});
  std::ranges::set_difference(training->all.split_inputs, of_all, std::back_inserter(result.left_out));
  result.training = std::make_shared<const Training>(narrowed(*training, of_all, best->of_folds));
  return result;
}

}  // namespace llmt
