#include "fit/trees/held_out_error.hpp"

#include <algorithm>

#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "fit/plan/memory.hpp"
#include "fit/trees/error_weights.hpp"
#include "fit/trees/grow_tree.hpp"

namespace llmt {

HeldOutFits held_out_error(const Training& training, const Plan& plan, const std::vector<int>& served, Work& work,
                           const GrownTree* grown) {
  const std::vector<FoldRows>& folds = training.folds;
  const int threads = training.options.max_threads;
  HeldOutFits fits{std::vector<GrownTree>(folds.size()), {}};
  // To choose takes about as long as to grow two trees in each fold.
  Work choosing(work, 2.0 / 3.0);
  parallel_for(std::ssize(folds), threads, [&](Eigen::Index f) {
    Work tree(work, 1.0 / (3.0 * static_cast<double>(folds.size())));
    fits.trees[f] = grown != nullptr ? *grown : grow_tree(folds[f].training, served, plan, false, threads, tree).tree;
  });
  Eigen::Index most_leaves = 0;
  for (const GrownTree& tree : fits.trees) most_leaves = std::max(most_leaves, tree.partition.num_leaves());
  refuse_beyond_memory(training, plan, most_leaves);
  const Eigen::VectorXd weights = error_weights(*training.table, served);
  fits.selection = select(folds, fits.trees, plan.candidates, weights, threads, choosing);
  return fits;
}

CandidateError mean_error(const std::vector<CandidateError>& errors, const std::vector<CandidateError>& units) {
  CandidateError mean{.candidate = {}, .fold_rmse = Eigen::VectorXd::Zero(errors.front().fold_rmse.size())};
  const auto partitions = static_cast<double>(errors.size());
  for (std::size_t p = 0; p < errors.size(); ++p) {
    const double unit = errors.size() > 1 && units[p].rmse > 0.0 ? units[p].rmse : 1.0;
    mean.rmse += errors[p].rmse / unit / partitions;
    mean.fold_rmse += errors[p].fold_rmse / (unit * partitions);
  }
  return mean;
}

void refuse_beyond_memory(const Training& training, const Plan& plan, Eigen::Index leaves) {
  const Eigen::Index folds = std::ssize(training.folds);
  refuse_beyond_memory(size_of(training.all, plan, leaves, folds, training.options.max_threads), machine_memory());
}

}  // namespace llmt
