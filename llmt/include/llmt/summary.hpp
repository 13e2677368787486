/// \file
/// What fit() tells of its work.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/model.hpp"
#include "llmt/options.hpp"

namespace llmt {

/// Why growth ended.
enum class StopReason {
  max_leaves,       ///< GrowthOptions::max_leaves reached
  significance,     ///< no leaf has a split that passes the F test
  variance_gain,    ///< no leaf has a split that lowers the residual variance enough
  leaf_samples,     ///< no leaf is large enough to be split, or all its split inputs are constant; M5': or its outputs
  exact_fit,        ///< the leaves reproduce the outputs to rounding
  improvement,      ///< GrowthOptions::min_improvement: further splits improved the tree too little
  aicc,             ///< LOLIMOT and HILOMOT without folds: the corrected Akaike criterion rose
  pruning,          ///< pruning by RETIS or M5' removed the last splits
  cross_validation  ///< fewer leaves than grown had the smallest held-out error
};

/// A way to make a model from a grown tree.
struct Candidate {
  Validity validity = {};
  double jump = no_jump;  ///< of a blend, see BlendOptions::jumps
  Estimation estimation = Estimation::as_grown;
  double ridge = 0.0;      ///< of joint estimation
  double shrinkage = 0.0;  ///< see BlendOptions::shrinkages
  bool sparse = false;     ///< see SparseChoice
  Eigen::Index leaves = 1;
};

/// A candidate and what it left on rows that took no part.
struct CandidateError {
  Candidate candidate;
  double rmse = 0.0;    ///< over all held-out rows, in the output's unit; for a shared partition of the errors divided
                        ///< by the outputs' standard deviations
  double spread = 0.0;  ///< standard deviation of the folds' RMSE; 0 for one fold
  Eigen::VectorXd fold_rmse = {};  ///< one per fold
};

/// How the splits of a tree were searched; RA, LOLIMOT and M5' do not search among two models' sums of squares.
struct SearchSummary {
  Eigen::Index exact_nodes = 0;
  Eigen::Index binned_nodes = 0;
  /// Splits whose residual sum of squares was computed.
  Eigen::Index evaluations = 0;
  /// Of the nodes searched by bins: the most by which the residual sum of squares of the split that was found can
  /// exceed that of the best one, as a fraction of the node's own. The true excess is far smaller as a rule.
  double largest_excess = 0.0;
};

/// What happened to one partition.
struct PartitionSummary {
  std::vector<int> outputs;
  Eigen::Index leaves = 0;        ///< in the model
  Eigen::Index grown_leaves = 0;  ///< before the choice by cross-validation
  StopReason stop = StopReason::leaf_samples;
  Eigen::Index rank_deficient_leaves =
      0;  ///< leaves whose rows do not determine all coefficients; those keep their parent's slopes. Sparse models: 0
  Eigen::Index coefficients = 0;  ///< of all leaves, for one output: constants and slopes that are not 0
  Eigen::VectorXd train_rmse;     ///< one per output of the partition
  CandidateError chosen;          ///< errors NaN without folds
  /// What it was chosen against: least squares first, then the best of each validity and width. Empty without folds.
  /// For many rows the errors of all blends but the best one are of models made from samples of the training rows.
  std::vector<CandidateError> best_of_kind;
  /// Held-out RMSE of the crisp prefixes with 1, 2, ... leaves; empty without folds.
  Eigen::VectorXd crisp_cv_rmse;
  Eigen::Index cv_folds = 0;
  Eigen::Index held_out_rows = 0;  ///< that errors are from, over all folds; at most 10000 of each
  SearchSummary search;            ///< of the tree grown on all rows
};

struct FitSummary {
  Eigen::Index samples = 0;           ///< of positive weight
  Eigen::Index missing_values = 0;    ///< in the inputs
  Eigen::Index min_leaf_samples = 0;  ///< as used
  std::vector<PartitionSummary> partitions;
  bool quadratic = false;  ///< whether the local models have products
  /// LocalTerms::automatic: what the terms that were not taken left on the held-out rows, one per partition. Else
  /// empty.
  std::vector<CandidateError> other_terms = {};
};

/// A few words for people: "the significance test".
std::string describe(StopReason reason);

}  // namespace llmt
