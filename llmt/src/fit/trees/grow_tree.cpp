#include "fit/trees/grow_tree.hpp"

#include <algorithm>

#include "estimation/jumps.hpp"
#include "estimation/tree_signs.hpp"
#include "growth/pruning.hpp"
#include "partition/tree.hpp"

namespace llmt {
namespace {

// Before weakest-link pruning the tree is grown to three times the requested leaves, because the gain of a split
// becomes visible only when the splits below it exist.
constexpr Eigen::Index grown_to_be_pruned = 3;

GrowthProblem problem_of(const TrainingRows& rows, const std::vector<int>& served, const Plan& plan,
                         bool keeps_all_leaves, int max_threads) {
  const Candidates& candidates = plan.candidates;
  GrowthProblem problem{.training = &rows, .outputs = served, .options = plan.growth, .max_threads = max_threads};
  problem.options.split_inputs = rows.split_inputs;
  problem.after = {.width = candidates.widths.empty() ? 0.0 : candidates.widths.front(),
                   .joint = !candidates.widths.empty() && candidates.estimation == Estimation::joint,
                   .keeps_all_leaves = keeps_all_leaves,
                   .has_leaf_limit = plan.leaves_given};
  return problem;
}

// Grows a larger tree and leaves of it what weakest-link pruning leaves, its splits in the order in which they pay.
GrownPartition grow_and_prune(GrowthProblem problem, const Rule& rule) {
  const Eigen::Index most = problem.options.max_leaves;
  if (rule.grows_larger_to_be_pruned) {
    problem.options.max_leaves = grown_to_be_pruned * std::min(most, problem.training->count());
  }
  GrownPartition grown = rule.grow(problem);
  Partition ordered{.outputs = {}, .nodes = in_pruning_order(grown.nodes, std::move(grown.gains))};
  if (most > 0 && ordered.num_leaves() > most) {
    ordered = prefix(ordered, most);
    grown.stop = StopReason::max_leaves;
  }
  grown.nodes = std::move(ordered.nodes);
  return grown;
}

}  // namespace

FinalTree grow_tree(const TrainingRows& rows, const std::vector<int>& served, const Plan& plan, bool keeps_all_leaves,
                    int max_threads, Work& work) {
  GrowthProblem problem = problem_of(rows, served, plan, keeps_all_leaves, max_threads);
  problem.work = &work;
  GrownPartition grown =
      plan.pruning == Pruning::last_splits ? plan.rule->grow(problem) : grow_and_prune(problem, *plan.rule);
  Partition partition{
      .outputs = served, .validity = {}, .nodes = std::move(grown.nodes), .outer_slope = {}, .residual_range = {}};
  if (!plan.rule->keeps_signs) keep_signs(rows, partition, max_threads);
  partition.outer_slope = agreed_slope(partition, partition.num_leaves());
  Eigen::VectorXd jumps = Eigen::VectorXd::Zero(std::ssize(partition.nodes));
  if (!plan.candidates.widths.empty() && plan.candidates.kind == ValidityKind::blend) {
    jumps = jump_sizes(rows, partition, max_threads);
  }
  work.finish();
  return {{std::move(partition), std::move(jumps)}, grown.stop, grown.search};
}

}  // namespace llmt
