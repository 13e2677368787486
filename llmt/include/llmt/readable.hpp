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

/// What is asked of a readable tree.
struct ReadableOptions {
  double loss = 0.15;      ///< held-out error above the yardstick that is taken for a smaller expression; 0.15: 15 %
  Eigen::Index rules = 0;  ///< 0: the default step. Else the step of the path with the most rules up to this number
};

/// A tree that can be had: what it says and what it costs.
struct ReadableStep {
  Eigen::Index leaves = 0;      ///< rules
  Eigen::Index most_terms = 0;  ///< regressors with a slope in the leaf that has most of them
  Eigen::Index size = 0;        ///< expression_size()
  /// Held-out root mean square error of the choice of this step, as CandidateError::rmse, and its standard deviation
  /// over the folds: on the rows of each fold predicts the tree that the other folds choose.
  double rmse = 0.0;
  double spread = 0.0;
  Eigen::VectorXd fold_rmse = {};  ///< one entry a fold
};

/// One partition of a readable model.
struct ReadablePartition {
  std::vector<int> outputs;      ///< columns that it serves
  Eigen::Index leaves = 0;       ///< rules
  Eigen::Index most_terms = 0;   ///< regressors with a slope in the leaf that has most of them
  Eigen::Index used_inputs = 0;  ///< inputs that occur in a split or an equation
  Eigen::Index size = 0;         ///< expression_size()
  double rmse = 0.0;             ///< as of ReadableStep
  double spread = 0.0;
  Eigen::VectorXd fold_rmse = {};
  std::vector<ReadableStep> path = {};  ///< ascending in rules; what is taken stands among them
  std::size_t taken = 0;                ///< position in `path`
  /// Smallest held-out error of the crisp trees of the fit and of the trees without products that were compared here.
  /// It is that of a choice among many, and a little too small.
  double yardstick = 0.0;
  bool is_within_loss = true;  ///< some tree's error is at most (1 + loss) yardstick; else the best one is the default
};

struct ReadableResult {
  Model model;
  std::vector<ReadablePartition> partitions;
  Intervals intervals;  ///< from the folds; empty without FitOptions::intervals
};

/// Finds, for every partition of a fit, crisp trees with short equations, one for each number of rules that pays. The
/// default is the one with the smallest expression whose held-out error is at most (1 + loss) times the smallest
/// held-out error of a crisp tree and no larger than that of sparse least squares, which is one rule.
/// Equations have few terms; coefficients and thresholds
/// are rounded; all of it, rounding included, is judged on the same folds as the fit. Between the smallest and the
/// largest training value of each input the model predicts what its printed equations say.
/// docs/algorithms/readable.md has the equations.
///
/// `prepared`: what the fit was made from; `fitted`: the fit's summary. Of the options the tree uses columns, weights,
/// folds, shared_partition, max_leaves, min_leaf_samples, trends, expert.search and max_threads; with
/// LocalTerms::quadratic or automatic equations may have products of two inputs.
///
/// Throws std::invalid_argument if the loss is negative or not finite, if rules is negative, if nothing was held out in
/// the fit, and with the words of why_not_readable() if there are any.
ReadableResult fit_readable(const PreparedFit& prepared, const FitSummary& fitted, const ReadableOptions& asked = {},
                            const Progress& progress = {});

/// The option that a readable tree does not go with, and why: "folds.count 0: the tree is chosen by its error on
/// held-out rows". Empty: there is none.
std::string why_not_readable(const FitOptions& options);

}  // namespace llmt
