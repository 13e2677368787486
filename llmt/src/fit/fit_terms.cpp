#include "fit/fit_terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>

#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "estimation/leaf_statistics.hpp"
#include "fit/error_weights.hpp"
#include "fit/grow_tree.hpp"
#include "fit/input_choice.hpp"
#include "fit/memory.hpp"
#include "fit/missing_weights.hpp"
#include "fit/output_range.hpp"
#include "fit/same_regressors.hpp"
#include "model/incomplete.hpp"
#include "selection/selection.hpp"

namespace llmt {
namespace {

// What all stages of a fit read.
struct Setting {
  const TrainingRows& all;
  const TrainingRows& measured;  // the same rows with the weights that they have in errors
  const std::vector<FoldRows>& folds;
  const Plan& plan;
  const FitOptions& options;
};

// Of the work of finishing: the chosen candidate in the folds, and as much of all rows.
constexpr double share_of_folds = 0.4;

void refuse_beyond_memory(const Setting& setting, Eigen::Index leaves) {
  const Eigen::Index folds = std::ssize(setting.folds);
  refuse_beyond_memory(size_of(setting.all, setting.plan, leaves, folds, setting.options.max_threads),
                       machine_memory());
}

Eigen::Index most_leaves(const std::vector<GrownTree>& trees) {
  Eigen::Index most = 0;
  for (const GrownTree& tree : trees) most = std::max(most, tree.partition.num_leaves());
  return most;
}

// The share of one tree in the work of growing those of the folds and that of all rows.
double share_of_tree(const Setting& setting) { return 1.0 / static_cast<double>(setting.folds.size() + 1); }

std::vector<GrownTree> grow_folds(const Setting& setting, const std::vector<int>& served, Work& growing) {
  std::vector<GrownTree> trees(setting.folds.size());
  const int threads = setting.options.max_threads;
  parallel_for(std::ssize(trees), threads, [&](Eigen::Index f) {
    Work tree(growing, share_of_tree(setting));
    trees[f] = grow_tree(setting.folds[f].training, served, setting.plan, false, threads, tree).tree;
  });
  return trees;
}

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
std::vector<Partition> finish_folds(const Setting& setting, const std::vector<GrownTree>& trees, Selection& choice,
                                    Work& finishing) {
  const int threads = setting.options.max_threads;
  std::vector<std::optional<Partition>> made = std::move(choice.made);
  made.resize(trees.size());
  parallel_for(std::ssize(trees), threads, [&](Eigen::Index f) {
    if (made[f]) return;
    Candidate of_fold = choice.chosen.candidate;
    of_fold.leaves = std::min(of_fold.leaves, trees[f].partition.num_leaves());
    made[f] = estimate(setting.folds[f].training, trees[f], of_fold, threads);
    finishing.did(share_of_folds / static_cast<double>(made.size()));
  });
  std::vector<Partition> partitions;
  for (std::optional<Partition>& partition : made) partitions.push_back(std::move(*partition));
  return partitions;
}

// What the leaves of a finished partition tell.
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

// A partition of the model, and of the folds' models.
struct FittedPartition {
  PartitionOn of_all;
  PartitionSummary summary;
  std::vector<PartitionOn> of_folds;
};

FittedPartition finish(const Setting& setting, const FinalTree& grown, Selection choice, std::vector<RangeGuard> guards,
                       std::vector<Partition> of_folds, Work& finishing) {
  const int threads = setting.options.max_threads;
  const Eigen::Index grown_leaves = grown.tree.partition.num_leaves();
  Candidate& candidate = choice.chosen.candidate;
  const bool fewer = candidate.leaves < grown_leaves;
  candidate.leaves = std::min(candidate.leaves, grown_leaves);
  Partition partition = estimate(setting.all, grown.tree, candidate, threads);
  finishing.did(share_of_folds);
  partition.output_range = output_range(guards, partition.outputs, setting.all);
  describe_leaves(setting.measured, partition, candidate.sparse, threads);
  finishing.finish();
  PartitionSummary summary = describe(partition, setting.measured, candidate.sparse);
  summary.grown_leaves = grown_leaves;
  summary.stop = fewer ? StopReason::cross_validation : grown.stop;
  summary.search = grown.search;
  summary.chosen = std::move(choice.chosen);
  summary.best_of_kind = std::move(choice.best_of_kind);
  summary.crisp_cv_rmse = std::move(choice.crisp_rmse);
  summary.cv_folds = std::ssize(setting.folds);
  summary.held_out_rows = choice.held_out_rows;
  summary.range_guards = std::move(guards);
  FittedPartition fitted{{setting.all.regressors, std::move(partition)}, std::move(summary), {}};
  for (std::size_t f = 0; f < of_folds.size(); ++f) {
    fitted.of_folds.push_back({setting.folds[f].training.regressors, std::move(of_folds[f])});
  }
  return fitted;
}

// Grow, choose, finish. The choice takes about as long as two trees of each fold, and the end as long as a tree.
FittedPartition fit_on_inputs(const Setting& setting, const std::vector<int>& served, Work& work) {
  const auto num_folds = static_cast<double>(setting.folds.size());
  const double trees_at_work = (num_folds + 1.0) + 2.0 * num_folds + 1.0;
  Work growing(work, (num_folds + 1.0) / trees_at_work);
  Work choosing(work, 2.0 * num_folds / trees_at_work);
  Work finishing(work, 1.0 / trees_at_work);
  const int threads = setting.options.max_threads;
  const bool has_folds = !setting.folds.empty();
  const Eigen::VectorXd weights = error_weights(*setting.all.table, served);
  std::vector<GrownTree> trees;
  Selection choice;
  FinalTree grown;
  // The tree of all rows needs nothing of the folds. Beside them it is work for the threads that would idle, because a
  // tree has ever less to do for several threads the smaller its leaves become.
  parallel_for(2, threads, [&](Eigen::Index job) {
    if (job == 1) {
      Work tree(growing, share_of_tree(setting));
      grown = grow_tree(setting.all, served, setting.plan, !has_folds, threads, tree);
      refuse_beyond_memory(setting, grown.tree.partition.num_leaves());
      return;
    }
    trees = grow_folds(setting, served, growing);
    refuse_beyond_memory(setting, most_leaves(trees));
    if (!has_folds) return;
    choice = select(setting.folds, trees, setting.plan.candidates, weights, threads, choosing);
  });
  if (!has_folds) choice = first_candidate(setting.plan.candidates, grown.tree.partition.num_leaves());
  std::vector<Partition> of_folds = finish_folds(setting, trees, choice, finishing);
  std::vector<RangeGuard> guards;
  if (has_folds) guards = guard_output_range(setting.folds, weights, threads, of_folds, choice.chosen);
  if (!setting.options.intervals) of_folds.clear();
  return finish(setting, grown, std::move(choice), std::move(guards), std::move(of_folds), finishing);
}

// With the inputs that are worth it.
FittedPartition fit_partition(const Setting& setting, const std::vector<int>& served, Work& work) {
  const Eigen::VectorXd weights = error_weights(*setting.all.table, served);
  const ChosenInputs chosen =
      choose_inputs(setting.all, setting.folds, served, weights, setting.plan, setting.options, work);
  Work fitting(work, work.left());
  const std::vector<int>& every = setting.all.split_inputs;
  FittedPartition fitted = [&] {
    if (chosen.of_all == every) return fit_on_inputs(setting, served, fitting);
    const TrainingRows all = narrowed(setting.all, chosen.of_all);
    const TrainingRows measured = narrowed(setting.measured, chosen.of_all);
    std::vector<FoldRows> folds;
    for (std::size_t f = 0; f < setting.folds.size(); ++f) {
      folds.push_back({narrowed(setting.folds[f].training, chosen.of_folds[f]),
                       narrowed(setting.folds[f].held_out, chosen.of_folds[f])});
    }
    const Plan plan = with_defaults(setting.options, all, std::ssize(folds));
    return fit_on_inputs({all, measured, folds, plan, setting.options}, served, fitting);
  }();
  std::ranges::set_difference(every, chosen.of_all, std::back_inserter(fitted.summary.left_out));
  fitted.summary.input_steps = chosen.steps;
  return fitted;
}

// Model and held-out residuals of every fold.
Intervals make_intervals(const Setting& setting, std::vector<FittedPartition>& fitted) {
  std::vector<Model> models;
  std::vector<std::span<const int>> held_out;
  const Table& table = *setting.all.table;
  for (std::size_t f = 0; f < fitted.front().of_folds.size(); ++f) {
    const FoldRows& rows = setting.folds[f];
    std::vector<PartitionOn> partitions;
    for (FittedPartition& each : fitted) partitions.push_back(std::move(each.of_folds[f]));
    models.push_back(make_model(rows.training, std::move(partitions)));
    held_out.emplace_back(rows.held_out.rows);
  }
  return held_out_intervals(std::move(models), table.inputs, table.outputs, held_out, setting.options.max_threads);
}

FitResult assemble(const Setting& setting, std::vector<FittedPartition> fitted) {
  const Table& table = *setting.all.table;
  FitSummary summary{.samples = setting.all.count(),
                     .missing_values = table.inputs.array().isNaN().count(),
                     .min_leaf_samples = setting.plan.growth.min_leaf_samples,
                     .partitions = {},
                     .quadratic = !table.products.empty()};
  Intervals intervals = make_intervals(setting, fitted);
  std::vector<PartitionOn> partitions;
  for (FittedPartition& each : fitted) {
    summary.partitions.push_back(std::move(each.summary));
    partitions.push_back(std::move(each.of_all));
  }
  return {make_model(setting.all, std::move(partitions)), std::move(summary), std::move(intervals)};
}

std::vector<int> all_rows(Eigen::Index count) {
  std::vector<int> rows(count);
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

}  // namespace

FitResult fit_terms(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                    const FitOptions& options, Work& work, const Eigen::VectorXd& loss_weights) {
  const FitData data(inputs, outputs, options, rule_of(options.rule).splits_on_monotone_inputs);
  const Table& table = data.table();
  Table weighted = data.trained(loss_weights);
  if (table.inputs.hasNaN())
    weighted.weights = weighted.weights.cwiseProduct(weights_by_missing(weighted, options, work));
  const TrainingRows all = training_rows(weighted, all_rows(table.inputs.rows()), options.max_threads);
  const TrainingRows measured = with_table(all, table);
  const std::vector<FoldRows> folds = deal(weighted, table, data.folds(), options.max_threads);
  const Plan plan = with_defaults(options, all, std::ssize(folds));
  const Setting setting{all, measured, folds, plan, options};
  refuse_beyond_memory(setting, 0);
  const std::vector<std::vector<int>> groups = output_groups(table.outputs.cols(), options.shared_partition);
  std::vector<std::optional<FittedPartition>> fitted(groups.size());
  const double share = work.left();
  // With a single hold-out rows are many, and one tree has work for all threads: several at a time would only hold more
  // rows in memory.
  const int groups_at_once = folds.size() == 1 ? 1 : options.max_threads;
  parallel_for(std::ssize(groups), groups_at_once, [&](Eigen::Index p) {
    Work part(work, share / static_cast<double>(groups.size()));
    fitted[p] = fit_partition(setting, groups[p], part);
  });
  std::vector<FittedPartition> finished;
  for (std::optional<FittedPartition>& each : fitted) finished.push_back(std::move(*each));
  FitResult result = assemble(setting, std::move(finished));
  result.summary.samples += data.copies();
  result.summary.copies = data.copies();
  result.summary.repeats = data.has_repeats();
  work.finish();
  return result;
}

}  // namespace llmt
