#include "fit/stages.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "selection/expected_work.hpp"

namespace llmt {

double operations_of_tree(const TrainingRows& rows, const Plan& plan) {
  const double depth = 1.0 + std::log2(static_cast<double>(expected_leaves(rows, plan)));
  return depth * operations_of_search(rows.count(), std::ssize(rows.split_inputs), std::ssize(rows.regressors) + 1);
}

Eigen::Index expected_leaves(const TrainingRows& rows, const Plan& plan) {
  const Eigen::Index leaves =
      std::max<Eigen::Index>(1, rows.count() / std::max<Eigen::Index>(1, plan.growth.min_leaf_samples));
  return plan.growth.max_leaves > 0 ? std::min(leaves, plan.growth.max_leaves) : leaves;
}

double operations_of_finish(const TrainingRows& all, const Candidate& candidate) {
  const Eigen::Index coefficients = std::ssize(all.regressors) + 1;
  return operations_of_estimate(all.count(), candidate, coefficients) +
         operations_of_pass(all.count(), candidate.leaves, candidate.validity.width) +
         operations_of_pass(all.count(), candidate.leaves, 0.0);
}

FitStages::FitStages(Work& work, std::size_t folds) {
  inputs = work.stage(0.0);
  for (std::size_t f = 0; f < folds; ++f) fold_trees.push_back(work.stage(0.0));
  tree = work.stage(0.0);
  selection = work.stage(0.0);
  finish = work.stage(0.0);
}

void FitStages::expect(const TrainingRows& all, const std::vector<FoldRows>& folds, const Plan& plan) const {
  const Eigen::Index leaves = expected_leaves(all, plan);
  const Candidates& candidates = plan.candidates;
  for (std::size_t f = 0; f < folds.size(); ++f) fold_trees[f].expect(operations_of_tree(folds[f].training, plan));
  tree.expect(operations_of_tree(all, plan));
  selection.expect(operations_of_selection(folds, std::ssize(all.regressors) + 1, candidates, leaves));
  Candidate usual{.leaves = leaves};
  if (!candidates.widths.empty()) usual.validity = {candidates.kind, candidates.widths[candidates.widths.size() / 2]};
  finish.expect(operations_of_finish(all, usual));
}

void ProgressReport::partition_at(std::size_t partition, double share) {
  const std::lock_guard<std::mutex> lock(mutex_);
  shares_[partition] = share;
  const double mean = std::accumulate(shares_.begin(), shares_.end(), 0.0) / static_cast<double>(shares_.size());
  show(std::min(total - 1, static_cast<Eigen::Index>(mean * static_cast<double>(total))));
}

void ProgressReport::show(Eigen::Index parts) {
  if (!options_.progress || parts <= shown_) return;
  shown_ = parts;
  options_.progress(parts, total);
}

}  // namespace llmt
