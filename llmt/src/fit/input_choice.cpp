#include "fit/input_choice.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

#include "base/parallel.hpp"
#include "data/fewer_inputs.hpp"
#include "fit/cheap_plan.hpp"
#include "fit/grow_tree.hpp"
#include "llmt/explain.hpp"
#include "llmt/statistics.hpp"
#include "selection/selection.hpp"

namespace llmt {
namespace {

// No smaller number is tried once the error is this multiple of the smallest. Errors rise and fall on the way.
constexpr double largest_ratio = 1.2;

// Fewer inputs have to be better by more than this many standard errors of the gain.
constexpr double standard_errors_of_a_gain = 2.0;

// With more rows for each input than this, coefficients of useless inputs cost too little to look for them.
constexpr Eigen::Index most_rows_per_input = 300;

// Of the work that is left, for a number of inputs.
constexpr double share_of_step = 0.1;

// Rows that importance looks at.
constexpr Eigen::Index ranking_rows = 300;

bool may_leave_out(const TrainingRows& all, std::size_t folds, const Plan& plan, const FitOptions& options) {
  const Candidates& candidates = plan.candidates;
  const Table& table = *all.table;
  const auto inputs = std::ssize(table.split_inputs);
  const bool is_usual = !plan.rule->has_own_models && plan.rule->overlapping == ValidityKind::blend &&
                        (candidates.widths.empty() || candidates.kind == ValidityKind::blend);
  return options.choose_inputs && options.max_leaves != 1 && is_usual && folds > 1 && inputs > 1 &&
         table.split_inputs == table.regression_inputs && table.monotone.empty() &&
         all.count() < most_rows_per_input * inputs;
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
                             std::optional<Partition> made, Candidate candidate, Eigen::Index count, int max_threads) {
  if (!made) {
    candidate.leaves = std::min(candidate.leaves, grown.partition.num_leaves());
    made = estimate(rows, grown, candidate, max_threads);
  }
  return most_important(inputs, importance_of(rows, std::move(*made), max_threads), count);
}

// A number of inputs in the walk.
struct Step {
  Eigen::Index inputs = 0;
  std::vector<std::vector<int>> of_folds;
  CandidateError chosen;
};

class Walk {
 public:
  Walk(const TrainingRows& all, const std::vector<FoldRows>& folds, const std::vector<int>& served,
       const Eigen::VectorXd& weights, const FitOptions& options, Work& work)
      : all_(all), folds_(folds), served_(served), weights_(weights), options_(options), work_(work) {}

  // Compares numbers of inputs, largest first, each fold's inputs ranked on its training rows.
  std::vector<Step> compare() const {
    std::vector<Step> steps;
    std::vector<std::vector<int>> of_folds(folds_.size(), all_.split_inputs);
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index size = std::ssize(all_.split_inputs); size >= 1; size = fewer_inputs(size)) {
      const Plan plan = plan_for(of_folds.front());
      Work step(work_, share_of_step * work_.left());
      Work choosing(step, 0.5);
      const std::vector<FoldRows> folds = narrowed_folds(of_folds);
      std::vector<GrownTree> trees(folds.size());
      parallel_for(std::ssize(folds), options_.max_threads, [&](Eigen::Index f) {
        Work tree(step, 0.5 / static_cast<double>(folds.size()));
        trees[f] = grow_tree(folds[f].training, served_, plan, false, options_.max_threads, tree).tree;
      });
      Selection selection = select(folds, trees, plan.candidates, weights_, options_.max_threads, choosing);
      steps.push_back({size, of_folds, selection.chosen});
      least = std::min(least, selection.chosen.rmse);
      if (size == 1 || selection.chosen.rmse > largest_ratio * least) return steps;
      selection.made.resize(folds.size());
      parallel_for(std::ssize(folds), options_.max_threads, [&](Eigen::Index f) {
        of_folds[f] = next_inputs(folds[f].training, of_folds[f], trees[f], std::move(selection.made[f]),
                                  selection.chosen.candidate, fewer_inputs(size), 1);
      });
    }
    return steps;
  }

  // The inputs of the last of some steps, ranked on all rows.
  std::vector<int> repeat(std::span<const Step> steps) const {
    std::vector<int> inputs = all_.split_inputs;
    for (const Step& step : steps.first(steps.size() - 1)) {
      const TrainingRows rows = narrowed(all_, inputs);
      Work tree(work_, share_of_step * work_.left() / static_cast<double>(folds_.size()));
      const FinalTree grown = grow_tree(rows, served_, plan_for(inputs), false, options_.max_threads, tree);
      inputs = next_inputs(rows, inputs, grown.tree, {}, step.chosen.candidate, fewer_inputs(step.inputs),
                           options_.max_threads);
    }
    return inputs;
  }

 private:
  Plan plan_for(const std::vector<int>& inputs) const {
    return cheap_plan(options_, narrowed(all_, inputs), std::ssize(folds_));
  }

  std::vector<FoldRows> narrowed_folds(const std::vector<std::vector<int>>& of_folds) const {
    std::vector<FoldRows> result;
    for (std::size_t f = 0; f < folds_.size(); ++f) {
      result.push_back({narrowed(folds_[f].training, of_folds[f]), narrowed(folds_[f].held_out, of_folds[f])});
    }
    return result;
  }

  const TrainingRows& all_;
  const std::vector<FoldRows>& folds_;
  const std::vector<int>& served_;
  const Eigen::VectorXd& weights_;
  const FitOptions& options_;
  Work& work_;
};

}  // namespace

ChosenInputs choose_inputs(const TrainingRows& all, const std::vector<FoldRows>& folds, const std::vector<int>& served,
                           const Eigen::VectorXd& weights, const Plan& plan, const FitOptions& options, Work& work) {
  const std::vector<int>& every = all.split_inputs;
  ChosenInputs result{every, std::vector<std::vector<int>>(folds.size(), every), {}};
  if (!may_leave_out(all, folds.size(), plan, options)) return result;
  const Walk walk(all, folds, served, weights, options, work);
  const std::vector<Step> steps = walk.compare();
  for (const Step& step : steps) result.steps.push_back({step.inputs, step.chosen.rmse});
  const auto best = std::ranges::min_element(steps, {}, [](const Step& step) { return step.chosen.rmse; });
  const PairedDifference gain = paired_difference(steps.front().chosen.fold_rmse, best->chosen.fold_rmse);
  if (gain.mean <= standard_errors_of_a_gain * gain.standard_error) return result;
  result.of_folds = best->of_folds;
  result.of_all = walk.repeat({steps.begin(), best + 1});
  return result;
}

}  // namespace llmt
