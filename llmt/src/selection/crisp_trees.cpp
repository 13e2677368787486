#include "selection/crisp_trees.hpp"

#include <algorithm>
#include <limits>

#include "base/parallel.hpp"
#include "estimation/local_estimate.hpp"
#include "estimation/squared_errors.hpp"

namespace llmt {
namespace {

// Errors of crisp trees whose leaves have to be in order: each number of leaves has models of its own, so only some
// are tried, each half as large again as the one before; the others are infinite.
Eigen::VectorXd ordered_prefix_errors(const LeafSums& sums, Eigen::Index largest, double shrinkage,
                                      const FoldRows& fold, const Eigen::VectorXd& weights) {
  Eigen::VectorXd errors = Eigen::VectorXd::Constant(largest, std::numeric_limits<double>::infinity());
  for (Eigen::Index leaves = 1;; leaves = std::min(largest, leaves + (leaves + 1) / 2)) {
    const Partition models = shrinkage > 0.0 ? local(sums, leaves, shrinkage) : as_grown(sums, leaves);
    std::vector<Chunk> held_out;
    for (Eigen::Index index = 0; index < num_chunks(fold.held_out); ++index) {
      held_out.push_back(fetch(fold.held_out, index, models.outputs));
    }
    errors(leaves - 1) = squared_error(models, fold.training, held_out, weights);
    if (leaves == largest) return errors;
  }
}

}  // namespace

void compare_crisp(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown,
                   const Candidates& candidates, const Eigen::VectorXd& weights, int max_threads,
                   const FoldErrors& error_of_folds, Selection& selection) {
  struct Variant {
    bool sparse;
    double shrinkage;
  };
  std::vector<Variant> variants;
  for (const bool sparse : candidates.sparse) {
    for (const double shrinkage : candidates.shrinkages) {
      variants.push_back({sparse, shrinkage});
    }
  }
  std::vector<std::vector<Eigen::VectorXd>> errors(variants.size(), std::vector<Eigen::VectorXd>(folds.size()));
  parallel_for(std::ssize(folds), max_threads, [&](Eigen::Index index) {
    const std::size_t f = index;
    const LeafSums sums = sum_leaves(folds[f].training, blended(folds[f].training, grown[f], {}, no_jump), max_threads,
                                     candidates.sparse.back());
    const Eigen::Index leaves = grown[f].partition.num_leaves();
    for (std::size_t v = 0; v < variants.size(); ++v) {
      const auto [sparse, shrinkage] = variants[v];
      if (has_ordered_leaves(sums)) {
        errors[v][f] = ordered_prefix_errors(sums, leaves, shrinkage, folds[f], weights);
        continue;
      }
      const Partition models =
          sparse || shrinkage > 0.0 ? local(sums, leaves, shrinkage, sparse) : as_grown(sums, leaves);
      errors[v][f] = prefix_squared_errors(models, folds[f].held_out, weights, max_threads);
      if (sparse && leaves > 1) {  // the root of a larger tree is full
        errors[v][f](0) =
            prefix_squared_errors(local(sums, 1, shrinkage, true), folds[f].held_out, weights, max_threads)(0);
      }
    }
  });
  Eigen::Index largest = 0;
  for (const Eigen::VectorXd& fold : errors.front()) {
    largest = std::max(largest, fold.size());
  }
  const auto error_of = [&](std::size_t variant, Eigen::Index leaves) {
    std::vector<double> of_folds;
    for (const Eigen::VectorXd& fold : errors[variant]) {
      of_folds.push_back(fold(std::min(leaves, fold.size()) - 1));  // a smaller tree stays at its last one
    }
    return error_of_folds(
        {.shrinkage = variants[variant].shrinkage, .sparse = variants[variant].sparse, .leaves = leaves}, of_folds);
  };
  selection.crisp_rmse = Eigen::VectorXd::Constant(largest, std::numeric_limits<double>::infinity());
  CandidateError best = error_of(0, 1);
  best.candidate.shrinkage = 0.0;
  selection.best_of_kind.push_back(best);
  for (std::size_t v = 0; v < variants.size(); ++v) {
    for (Eigen::Index leaves = 1; leaves <= largest; ++leaves) {
      const CandidateError error = error_of(v, leaves);
      selection.crisp_rmse(leaves - 1) = std::min(selection.crisp_rmse(leaves - 1), error.rmse);
      if (error.rmse < best.rmse) {
        best = error;
      }
    }
  }
  selection.chosen = selection.best_of_kind.front();
  if (candidates.crisp) {
    selection.best_of_kind.push_back(best);
    selection.chosen = best;
  }
}

}  // namespace llmt
