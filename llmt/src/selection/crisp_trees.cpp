#include "selection/crisp_trees.hpp"

#include <algorithm>
#include <limits>

#include "base/parallel.hpp"
#include "estimation/local_estimate.hpp"
#include "estimation/squared_errors.hpp"
#include "llmt/statistics.hpp"

namespace llmt {
namespace {

// Errors of crisp trees whose leaves have to be in order: each number of leaves has models of its own, so only some
// are tried, each half as large again as the one before; the others are infinite.
Eigen::VectorXd ordered_prefix_errors(const LeafSums& sums, Eigen::Index largest, double shrinkage,
                                      const FoldRows& fold, const Eigen::VectorXd& weights) {
  Eigen::VectorXd errors = Eigen::VectorXd::Constant(largest, std::numeric_limits<double>::infinity());
  for (Eigen::Index leaves = 1;; leaves = std::min(largest, leaves + (leaves + 1) / 2)) {
    const Partition models = shrinkage > 0.0 ? local(sums, leaves, shrinkage) : as_grown(sums, leaves);
    const std::vector<Chunk> held_out = fetch_all(fold.held_out, models.outputs);
    errors(leaves - 1) = squared_errors(models, fold.training, held_out, weights).sum();
    if (leaves == largest) return errors;
  }
}

// How the crisp trees of a comparison are estimated.
struct Variant {
  bool sparse;
  double shrinkage;
};

std::vector<Variant> variants_of(const Candidates& candidates) {
  std::vector<Variant> variants;
  for (const bool sparse : candidates.sparse) {
    for (const double shrinkage : candidates.shrinkages) variants.push_back({sparse, shrinkage});
  }
  return variants;
}

// Errors of the crisp trees of one fold on its held-out rows.
struct CrispErrors {
  std::vector<Eigen::VectorXd> of_trees;  // of each variant: squared errors of the trees with 1, 2, ... leaves
  std::vector<double> of_ridges;          // of one leaf, for each of the linear shrinkages
};

CrispErrors errors_in_fold(const FoldRows& fold, const GrownTree& grown, const std::vector<Variant>& variants,
                           const std::vector<double>& ridges, const Eigen::VectorXd& weights, int max_threads) {
  const LeafSums sums =
      sum_leaves(fold.training, blended(fold.training, grown, {}, no_jump), max_threads, variants.back().sparse);
  const Eigen::Index leaves = grown.partition.num_leaves();
  CrispErrors result;
  for (const double ridge : ridges) {
    result.of_ridges.push_back(
        prefix_squared_errors(local(sums, 1, ridge), sums.partition, fold.held_out, weights, max_threads)(0));
  }
  std::vector<Eigen::VectorXd>& errors = result.of_trees;
  for (const auto& [sparse, shrinkage] : variants) {
    if (has_ordered_leaves(sums)) {
      errors.push_back(ordered_prefix_errors(sums, leaves, shrinkage, fold, weights));
      continue;
    }
    const Partition models =
        sparse || shrinkage > 0.0 ? local(sums, leaves, shrinkage, sparse) : as_grown(sums, leaves);
    errors.push_back(prefix_squared_errors(models, sums.partition, fold.held_out, weights, max_threads));
    if (sparse && leaves > 1) {  // the root of a larger tree is full
      const Partition one_leaf = local(sums, 1, shrinkage, true);
      errors.back()(0) = prefix_squared_errors(one_leaf, sums.partition, fold.held_out, weights, max_threads)(0);
    }
  }
  return result;
}

// The ridge regression with the smallest error, if its gain on least squares is more than a standard error.
CandidateError best_linear(const CandidateError& least_squares, const std::vector<CrispErrors>& errors,
                           const std::vector<double>& ridges, const FoldErrors& error_of_folds) {
  CandidateError best = least_squares;
  for (std::size_t r = 0; r < ridges.size(); ++r) {
    std::vector<double> of_folds;
    for (const CrispErrors& fold : errors) of_folds.push_back(fold.of_ridges[r]);
    const CandidateError ridge = error_of_folds({.shrinkage = ridges[r], .leaves = 1}, of_folds);
    if (ridge.rmse < best.rmse) best = ridge;
  }
  const PairedDifference gain = paired_difference(least_squares.fold_rmse, best.fold_rmse);
  return gain.mean > gain.standard_error ? best : least_squares;
}

}  // namespace

void compare_crisp(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown,
                   const Candidates& candidates, const Eigen::VectorXd& weights, int max_threads,
                   const FoldErrors& error_of_folds, Work& work, Selection& selection) {
  const std::vector<Variant> variants = variants_of(candidates);
  const std::vector<double>& ridges = candidates.linear_shrinkages;
  std::vector<CrispErrors> errors(folds.size());
  parallel_for(std::ssize(folds), max_threads, [&](Eigen::Index f) {
    errors[f] = errors_in_fold(folds[f], grown[f], variants, ridges, weights, max_threads);
    work.did(1.0 / static_cast<double>(folds.size()));
  });
  Eigen::Index largest = 0;
  for (const CrispErrors& fold : errors) largest = std::max(largest, fold.of_trees.front().size());
  const auto error_of = [&](std::size_t variant, Eigen::Index leaves) {
    std::vector<double> of_folds;
    for (const CrispErrors& fold : errors) {
      // A smaller tree stays at its largest number of leaves.
      const Eigen::VectorXd& of_trees = fold.of_trees[variant];
      of_folds.push_back(of_trees(std::min(leaves, of_trees.size()) - 1));
    }
    return error_of_folds(
        {.shrinkage = variants[variant].shrinkage, .sparse = variants[variant].sparse, .leaves = leaves}, of_folds);
  };
  selection.crisp_rmse = Eigen::VectorXd::Constant(largest, std::numeric_limits<double>::infinity());
  CandidateError best = error_of(0, 1);
  best.candidate.shrinkage = 0.0;
  selection.best_of_kind.push_back(best);
  selection.linear = best_linear(best, errors, ridges, error_of_folds);
  for (std::size_t v = 0; v < variants.size(); ++v) {
    for (Eigen::Index leaves = 1; leaves <= largest; ++leaves) {
      const CandidateError error = error_of(v, leaves);
      selection.crisp_rmse(leaves - 1) = std::min(selection.crisp_rmse(leaves - 1), error.rmse);
      if (error.rmse < best.rmse) {
        best = error;
      }
    }
  }
  selection.chosen = selection.linear;
  if (candidates.crisp) {
    if (selection.linear.candidate.shrinkage > 0.0) selection.best_of_kind.push_back(selection.linear);
    selection.best_of_kind.push_back(best);
    if (best.rmse < selection.chosen.rmse) selection.chosen = best;
  }
}

}  // namespace llmt
