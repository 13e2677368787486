/// \file
/// The smallest crisp tree with short equations that predicts nearly as well as the best crisp tree.
///
///     const llmt::PreparedFit prepared({inputs, outputs});
///     const llmt::FitResult fitted = llmt::fit(prepared);
///     const llmt::ReadableResult readable = llmt::fit_readable(prepared, fitted.summary);
///     const double error = readable.partitions[0].rmse;  // held-out
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "llmt/model.hpp"
#include "llmt/progress.hpp"
#include "llmt/summary.hpp"

namespace llmt {

/// One partition of a readable model.
struct ReadablePartition {
  std::vector<int> outputs;      ///< columns that it serves
  Eigen::Index leaves = 0;       ///< rules
  Eigen::Index most_terms = 0;   ///< regressors with a slope in the leaf that has most of them
  Eigen::Index used_inputs = 0;  ///< inputs that occur in a split or an equation
  Eigen::Index size = 0;         ///< expression_size()
  /// Held-out root mean square error, as CandidateError::rmse, and its standard deviation over the folds. It is the
  /// error of the smallest of many trees that were good enough, and therefore a little too small.
  double rmse = 0.0;
  double spread = 0.0;
  Eigen::VectorXd fold_rmse = {};  ///< one entry a fold
  /// Smallest held-out error of the crisp trees of the fit and of the trees without products that were compared here.
  double best_crisp = 0.0;
  bool is_within_loss = true;  ///< rmse <= (1 + loss) best_crisp; else no tree was, and this is the best one
};

struct ReadableResult {
  Model model;
  std::vector<ReadablePartition> partitions;
  Intervals intervals;  ///< from the folds; empty without FitOptions::intervals
};

/// Finds, for every partition of a fit, the crisp tree with the smallest expression whose held-out error is at most
/// (1 + loss) times the smallest held-out error of a crisp tree. Equations have few terms; coefficients and thresholds
/// are rounded; all of it, rounding included, is judged on the same folds as the fit. Between the smallest and the
/// largest training value of each input the model predicts what its printed equations say.
/// docs/algorithms/readable.md has the equations.
///
/// `prepared`: what the fit was made from; `fitted`: the fit's summary. Of the options the tree uses columns, weights,
/// folds, shared_partition, max_leaves, min_leaf_samples, expert.search and max_threads; with LocalTerms::quadratic or
/// automatic equations may have products of two inputs. `loss`: 0.15 for 15 per cent.
///
/// Throws std::invalid_argument if `loss` is negative or not finite, if nothing was held out in the fit, and with the
/// words of why_not_readable() if there are any.
ReadableResult fit_readable(const PreparedFit& prepared, const FitSummary& fitted, double loss = 0.15,
                            const Progress& progress = {});

/// The option that a readable tree does not go with, and why: "folds.count 0: the tree is chosen by its error on
/// held-out rows". Empty: there is none.
std::string why_not_readable(const FitOptions& options);

}  // namespace llmt
