#include "fit/assemble.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "base/parallel.hpp"
#include "estimation/leaf_statistics.hpp"
#include "fit/choices/code_choice.hpp"
#include "fit/equal_row_errors.hpp"
#include "fit/output_range.hpp"
#include "fit/trees/error_weights.hpp"
#include "model/codes.hpp"
#include "model/held_out_intervals.hpp"

namespace llmt {
namespace {

// Share of the work of finishing that the chosen candidate takes in the folds, and as much again on all rows.
constexpr double share_of_folds = 0.4;

// The first of all candidates, and all leaves.
Selection first_candidate(const Candidates& candidates, Eigen::Index leaves) {
  Candidate first{.shrinkage = candidates.shrinkages.front(), .sparse = candidates.sparse.front(), .leaves = leaves};
  if (!candidates.widths.empty()) {
    first.validity = {candidates.kind, candidates.widths.front()};
    first.jump = candidates.jumps.front();
    first.estimation = candidates.estimation;
    first.ridge = candidates.ridges.empty() ? 0.0 : candidates.ridges.front();
  }
  Selection selection;
  selection.chosen = {first, std::nan(""), std::nan("")};
  return selection;
}

// The chosen candidate in every fold, for the guard of the range and the intervals.
std::vector<Partition> finish_folds(const Training& training, const std::vector<GrownTree>& trees, Selection& choice,
                                    Work& work) {
  const int threads = training.options.max_threads;
  std::vector<std::optional<Partition>> made = std::move(choice.made);
  made.resize(trees.size());
  parallel_for(std::ssize(trees), threads, [&](Eigen::Index f) {
    if (made[f]) return;
    Candidate of_fold = choice.chosen.candidate;
    of_fold.leaves = std::min(of_fold.leaves, trees[f].partition.num_leaves());
    made[f] = estimate(training.folds[f].training, trees[f], of_fold, threads, work);
    work.did(share_of_folds / static_cast<double>(made.size()));
  });
  std::vector<Partition> partitions;
  for (std::optional<Partition>& partition : made) partitions.push_back(std::move(*partition));
  return partitions;
}

// Numbers of leaves, coefficients and errors of a finished partition.
PartitionSummary describe(const Partition& partition, const TrainingRows& rows, bool sparse) {
  PartitionSummary summary;
  summary.outputs = partition.outputs;
  summary.leaves = partition.num_leaves();
  Eigen::VectorXd rss = Eigen::VectorXd::Zero(std::ssize(partition.outputs));
  for (const Node& node : partition.nodes) {
    if (node.is_leaf()) {
      rss += node.rss;
      summary.rank_deficient_leaves += !sparse && node.rank < std::ssize(rows.regressors) + 1 ? 1 : 0;
      summary.coefficients += 1 + (node.slope.row(0).array() != 0.0).count();
    }
  }
  summary.train_rmse = (rss / total_weight(rows)).cwiseSqrt();
  return summary;
}

// Model and held-out residuals of every fold.
Intervals make_intervals(const Training& training, std::vector<std::optional<FittedPartition>>& fitted,
                         const Model& of_all) {
  std::vector<Model> models;
  std::vector<std::span<const int>> held_out;
  const Table& table = *training.table;
  for (std::size_t f = 0; f < fitted.front()->of_folds.size(); ++f) {
    const FoldRows& rows = training.folds[f];
    std::vector<PartitionOn> partitions;
    for (auto& each : fitted) partitions.push_back(std::move(each->of_folds[f]));
    models.push_back(make_model(rows.training, std::move(partitions)));
    held_out.emplace_back(rows.held_out.rows);
  }
  return held_out_intervals(std::move(models), of_all,
                            {table.inputs, table.outputs, training.kept->precisions, copies_of(*training.kept),
                             std::move(held_out), training.options.max_leaves},
                            training.options.max_threads);
}

}  // namespace

FittedPartition finish(const ChosenInputs& inputs, const Plan& plan, const FinalTree& grown, HeldOutFits of_folds,
                       Work& work) {
  const Training& training = *inputs.training;
  Work finishing(work, work.left());
  const int threads = training.options.max_threads;
  const bool has_folds = !training.folds.empty();
  const std::vector<int>& served = grown.tree.partition.outputs;
  const Eigen::Index grown_leaves = grown.tree.partition.num_leaves();
  Selection choice = has_folds ? std::move(of_folds.selection) : first_candidate(plan.candidates, grown_leaves);
  std::vector<Partition> fold_partitions = finish_folds(training, of_folds.trees, choice, finishing);
  std::vector<RangeGuard> guards;
  if (has_folds) {
    const Eigen::VectorXd weights = error_weights(*training.table, served);
    guards = guard_output_range(training.folds, weights, threads, fold_partitions, choice.chosen);
  }
  std::optional<EqualRowErrors> equal_rows = equal_row_errors(training, fold_partitions);
  if (!training.options.intervals) fold_partitions.clear();
  Candidate& candidate = choice.chosen.candidate;
  const bool fewer = candidate.leaves < grown_leaves;
  candidate.leaves = std::min(candidate.leaves, grown_leaves);
  Partition partition = estimate(training.all, grown.tree, candidate, threads, finishing);
  finishing.did(share_of_folds);
  partition.output_range = output_range(guards, served, training.all);
  describe_leaves(training.measured, partition, candidate.sparse, threads, finishing);
  if (training.taught != nullptr) count_rows(training.measured, partition);
  finishing.finish();
  PartitionSummary summary = describe(partition, training.measured, candidate.sparse);
  summary.grown_leaves = grown_leaves;
  summary.stop = fewer ? StopReason::cross_validation : grown.stop;
  summary.search = grown.search;
  summary.chosen = std::move(choice.chosen);
  summary.best_of_kind = std::move(choice.best_of_kind);
  summary.crisp_cv_rmse = std::move(choice.crisp_rmse);
  summary.cv_folds = std::ssize(training.folds);
  summary.held_out_rows = choice.held_out_rows;
  summary.range_guards = std::move(guards);
  summary.equal_rows = std::move(equal_rows);
  summary.left_out = inputs.left_out;
  summary.input_steps = inputs.steps;
  FittedPartition fitted{{training.all.regressors, std::move(partition)}, std::move(summary), {}};
  for (std::size_t f = 0; f < fold_partitions.size(); ++f) {
    fitted.of_folds.push_back({training.folds[f].training.regressors, std::move(fold_partitions[f])});
  }
  return fitted;
}

FitResult assemble(const Training& training, std::vector<std::optional<FittedPartition>> fitted) {
  FitSummary summary{.min_leaf_samples = plan_of(training).growth.min_leaf_samples,
                     .partitions = {},
                     .quadratic = !training.table->products.empty()};
  std::vector<PartitionOn> partitions;
  for (auto& each : fitted) {
    summary.partitions.push_back(std::move(each->summary));
    partitions.push_back(std::move(each->of_all));
  }
  Model model = make_model(training.all, std::move(partitions));
  Intervals intervals = make_intervals(training, fitted, model);
  return {std::move(model), std::move(summary), std::move(intervals)};
}

namespace {

Eigen::Index missing_values(const KeptRows& kept, const std::vector<std::size_t>& empty_levels) {
  const auto inputs = kept.inputs.values.array();
  Eigen::Index count = inputs.isNaN().count();
  for (std::size_t j = 0; j < empty_levels.size(); ++j) {
    if (empty_levels[j] > 0) count += (inputs.col(j) == static_cast<double>(empty_levels[j] - 1)).count();
  }
  return count;
}

}  // namespace

FitResult with_choices(FitResult result, const PreparedRows& rows) {
  const KeptRows& kept = *rows.training->kept;
  if (rows.has_positions()) {
    result.model = with_codes(result.model, rows.codes.codes, rows.empty_levels);
    result.intervals = with_codes(result.intervals, rows.codes.codes, rows.empty_levels);
  }
  result.summary.missing_values = missing_values(kept, rows.empty_levels);
  result.summary.samples = learned_rows(kept);
  result.summary.copies = kept.copies;
  result.summary.repeats = kept.has_repeats;
  result.summary.codes = rows.codes;
  result.summary.loss_weights = rows.loss_weights;
  result.summary.held_out = held_out_rows(kept);
  return result;
}

}  // namespace llmt
