#include "llmt/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "base/parallel.hpp"
#include "data/dataset.hpp"
#include "estimation/joint_fit.hpp"
#include "estimation/jumps.hpp"
#include "estimation/tree_signs.hpp"
#include "fit/defaults.hpp"
#include "fit/linear_or_quadratic.hpp"
#include "fit/validate.hpp"
#include "growth/best_first/best_first.hpp"
#include "growth/hilomot/hilomot.hpp"
#include "growth/lolimot/lolimot.hpp"
#include "growth/m5/growth.hpp"
#include "growth/pruning.hpp"
#include "selection/selection.hpp"

namespace llmt {
namespace {

// A tree that is pruned by the weakest link has so many times the leaves that are asked for before: what a split gains
// shows when those below it are made. Not with LOLIMOT and HILOMOT, whose splits cost too much for that.
constexpr Eigen::Index grown_to_be_pruned = 3;

std::vector<int> all_rows(Eigen::Index count) {
  std::vector<int> rows(count);
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

// What growth needs of the rows lives no longer than this.
GrownPartition grow_in_order(const TrainingRows& rows, const std::vector<int>& served, const Plan& plan,
                             bool stop_by_aicc, int max_threads) {
  const Table& table = *rows.table;
  GrowthProblem problem{&rows, served, plan.growth, max_threads};
  problem.options.split_inputs = table.split_inputs;
  if (is_hilomot(problem.options.rule)) {
    const bool joint = !plan.candidates.widths.empty() && plan.candidates.estimation == Estimation::joint;
    return grow_hilomot(problem, {joint ? GateModels::joint : GateModels::local, stop_by_aicc && !plan.leaves_given});
  }
  if (problem.options.rule == GrowthRule::m5) return grow_m5(problem);
  if (!is_lolimot(problem.options.rule)) return grow(problem);
  const double width = plan.candidates.widths.empty() ? 0.0 : plan.candidates.widths.front();
  return grow_lolimot(problem, {.width = width,
                                .low = rows.low()(table.split_inputs),
                                .high = rows.high()(table.split_inputs),
                                .data_driven = problem.options.rule == GrowthRule::lolimot_data_driven,
                                .stop_by_aicc = stop_by_aicc});
}

GrownPartition grow_nodes(const TrainingRows& rows, const std::vector<int>& served, const Plan& plan, bool stop_by_aicc,
                          int max_threads) {
  if (plan.growth.pruning == Pruning::last_splits) {
    return grow_in_order(rows, served, plan, stop_by_aicc, max_threads);
  }
  Plan larger = plan;
  if (!is_lolimot(plan.growth.rule) && !is_hilomot(plan.growth.rule)) {
    larger.growth.max_leaves = grown_to_be_pruned * std::min(plan.growth.max_leaves, rows.count());
  }
  GrownPartition result = grow_in_order(rows, served, larger, stop_by_aicc, max_threads);
  Partition ordered{.outputs = {}, .nodes = in_pruning_order(result.nodes, std::move(result.gains))};
  if (plan.growth.max_leaves > 0 && ordered.num_leaves() > plan.growth.max_leaves) {
    ordered = prefix(ordered, plan.growth.max_leaves);
    result.stop = StopReason::max_leaves;
  }
  result.nodes = std::move(ordered.nodes);
  return result;
}

struct Grown {
  GrownTree tree;
  StopReason stop = StopReason::leaf_samples;
  SearchSummary search;
};

Grown grow_rows(const TrainingRows& rows, const std::vector<int>& served, const Plan& plan, bool stop_by_aicc,
                int max_threads) {
  GrownPartition result = grow_nodes(rows, served, plan, stop_by_aicc, max_threads);
  Partition partition{
      .outputs = served, .validity = {}, .nodes = std::move(result.nodes), .outer_slope = {}, .residual_range = {}};
  if (!is_lolimot(plan.growth.rule)) {
    keep_signs(rows, partition, max_threads);
  }
  partition.outer_slope = agreed_slope(partition);
  Eigen::VectorXd jumps = Eigen::VectorXd::Zero(std::ssize(partition.nodes));
  if (!plan.candidates.widths.empty() && plan.candidates.kind == ValidityKind::blend) {
    jumps = jump_sizes(rows, partition, max_threads);
  }
  return {{std::move(partition), std::move(jumps)}, result.stop, result.search};
}

// Weights of the outputs' squared errors: 1 for a single one; else 1 / variance, so that outputs of any scale count
// alike.
Eigen::VectorXd error_weights(const Table& table, const std::vector<int>& served) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(std::ssize(served));
  for (std::size_t o = 0; o < served.size() && served.size() > 1; ++o) {
    const auto output = table.outputs.col(served[o]).array();
    const double variance = (output - output.mean()).square().mean();
    weights(o) = variance > 0.0 ? 1.0 / variance : 1.0;
  }
  return weights;
}

PartitionSummary summarise(const Partition& partition, const TrainingRows& rows, bool sparse) {
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

}  // namespace

FitResult fit(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
              const FitOptions& options) {
  check_options(options, inputs.cols());
  if (options.local_models.terms == LocalTerms::automatic) {
    return fit_best_terms(inputs, outputs, options);
  }
  const Table table = make_table(inputs, outputs, options);
  if (const std::vector<Eigen::Index> kept = rows_with_weight(table); std::ssize(kept) < inputs.rows()) {
    FitOptions of_kept = options;
    of_kept.weights = table.weights(kept);
    std::vector<double> groups;
    for (const Eigen::Index row : kept) {
      if (!options.selection.folds.groups.empty()) {
        groups.push_back(options.selection.folds.groups[row]);
      }
    }
    of_kept.selection.folds.groups = groups;
    return fit(inputs(kept, Eigen::all), outputs(kept, Eigen::all), of_kept);
  }
  const TrainingRows all = training_rows(table, all_rows(inputs.rows()), options.max_threads);
  std::vector<FoldRows> folds;
  for (const Fold& fold : selection_folds(inputs.rows(), options.selection)) {
    TrainingRows training = training_rows(table, {fold.train.begin(), fold.train.end()}, options.max_threads);
    TrainingRows held_out = query_rows(table, {fold.held_out.begin(), fold.held_out.end()}, training);
    folds.push_back({std::move(training), std::move(held_out)});
  }
  const Plan plan = make_plan(options, all, std::ssize(folds));

  std::vector<std::vector<int>> served;
  for (int o = 0; o < outputs.cols(); ++o) {
    if (plan.growth.shared_partition && o > 0) {
      served.front().push_back(o);
    } else {
      served.push_back({o});
    }
  }
  const Eigen::Index tasks = std::ssize(served) * (std::ssize(folds) + 1);
  std::mutex progress_mutex;
  Eigen::Index done = 0;
  const auto report = [&] {
    if (options.progress) {
      const std::lock_guard<std::mutex> lock(progress_mutex);
      options.progress(++done, tasks);
    }
  };
  std::vector<std::optional<Partition>> partitions(served.size());
  FitSummary summary{.samples = all.count(),
                     .missing_values = inputs.array().isNaN().count(),
                     .min_leaf_samples = plan.growth.min_leaf_samples,
                     .partitions = std::vector<PartitionSummary>(served.size()),
                     .quadratic = !table.products.empty()};
  // Of every fold: one partition for each group of outputs.
  std::vector<std::vector<std::optional<Partition>>> fold_partitions(
      options.intervals ? folds.size() : 0, std::vector<std::optional<Partition>>(served.size()));
  // Where rows are many enough for one hold-out, a tree has work for all threads; several at a time would only hold
  // their rows in memory together.
  const int trees_at_once = folds.size() == 1 ? 1 : options.max_threads;
  parallel_for(std::ssize(served), trees_at_once, [&](Eigen::Index index) {
    const std::size_t p = index;
    const Eigen::VectorXd weights = error_weights(table, served[p]);
    std::vector<GrownTree> trees(folds.size());  // of the folds
    parallel_for(std::ssize(trees), options.max_threads, [&](Eigen::Index f) {
      const FoldRows& fold = folds[f];
      trees[f] = grow_rows(fold.training, served[p], plan, false, options.max_threads).tree;
      report();
    });
    Selection selection;
    Candidate candidate;
    if (!trees.empty()) {
      selection = select(folds, trees, plan.candidates, weights, options.max_threads);
      candidate = selection.chosen.candidate;
    }
    Grown grown = grow_rows(all, served[p], plan, trees.empty(), options.max_threads);
    const Eigen::Index grown_leaves = grown.tree.partition.num_leaves();
    if (trees.empty()) {
      candidate.leaves = grown_leaves;
      candidate.shrinkage = plan.candidates.shrinkages.front();
      candidate.sparse = plan.candidates.sparse.front();
      if (!plan.candidates.widths.empty()) {
        candidate.validity = {plan.candidates.kind, plan.candidates.widths.front()};
        candidate.jump = plan.candidates.jumps.front();
        candidate.estimation = plan.candidates.estimation;
        candidate.ridge = plan.candidates.ridges.empty() ? 0.0 : plan.candidates.ridges.front();
      }
    } else if (candidate.leaves < grown_leaves) {
      grown.stop = StopReason::cross_validation;
    }
    parallel_for(std::ssize(fold_partitions), options.max_threads, [&](Eigen::Index f) {
      const GrownTree& tree = trees[f];
      if (!selection.made.empty()) {
        fold_partitions[f][p] = std::move(selection.made[f]);
        return;
      }
      Candidate of_fold = candidate;
      of_fold.leaves = std::min(of_fold.leaves, tree.partition.num_leaves());
      fold_partitions[f][p] = estimate(folds[f].training, tree, of_fold, options.max_threads);
    });
    candidate.leaves = std::min(candidate.leaves, grown_leaves);
    Partition partition = estimate(all, grown.tree, candidate, options.max_threads);
    describe_leaves(all, partition, candidate.sparse, options.max_threads);
    PartitionSummary described = summarise(partition, all, candidate.sparse);
    described.grown_leaves = grown_leaves;
    described.stop = grown.stop;
    described.search = grown.search;
    described.chosen = trees.empty() ? CandidateError{candidate, std::nan(""), std::nan("")} : selection.chosen;
    described.chosen.candidate.leaves = candidate.leaves;
    described.best_of_kind = std::move(selection.best_of_kind);
    described.crisp_cv_rmse = std::move(selection.crisp_rmse);
    described.cv_folds = std::ssize(trees);
    described.held_out_rows = selection.held_out_rows;
    summary.partitions[p] = std::move(described);
    partitions[p] = std::move(partition);
    report();
  });
  std::vector<Partition> finished;
  for (std::optional<Partition>& partition : partitions) {
    finished.push_back(std::move(*partition));
  }
  std::vector<Model> fold_models;
  std::vector<Eigen::MatrixXd> residuals;
  for (std::size_t f = 0; f < fold_partitions.size(); ++f) {
    const FoldRows& rows = folds[f];
    std::vector<Partition> of_fold;
    for (std::optional<Partition>& partition : fold_partitions[f]) {
      of_fold.push_back(std::move(*partition));
    }
    fold_models.emplace_back(rows.training.columns, rows.training.output_columns, rows.training.regressors,
                             std::move(of_fold));
    const std::vector<int>& held_out = rows.held_out.rows;
    const Eigen::MatrixXd predicted = fold_models.back().predict(inputs(held_out, Eigen::all), options.max_threads);
    residuals.push_back((outputs(held_out, Eigen::all) - predicted).cwiseAbs());
  }
  return {Model(all.columns, all.output_columns, all.regressors, std::move(finished)), std::move(summary),
          Intervals(std::move(fold_models), std::move(residuals))};
}

Eigen::VectorXd rmse(const Eigen::Ref<const Eigen::MatrixXd>& predicted,
                     const Eigen::Ref<const Eigen::MatrixXd>& measured) {
  if (predicted.rows() != measured.rows() || predicted.cols() != measured.cols() || predicted.rows() == 0) {
    throw std::invalid_argument(
        fmt::format("llmt::rmse: predicted is {} x {}, measured is {} x {}; the shapes must agree and have rows",
                    predicted.rows(), predicted.cols(), measured.rows(), measured.cols()));
  }
  return ((predicted - measured).colwise().squaredNorm() / static_cast<double>(predicted.rows()))
      .cwiseSqrt()
      .transpose();
}

}  // namespace llmt
