/// \file
/// What fit() reports of its work.
///
///     for (const llmt::PartitionSummary& partition : result.summary.partitions) {
///       std::printf("%td leaves, held-out RMSE %g\n", partition.leaves, partition.chosen.rmse);
///     }
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/options.hpp"
#include "llmt/partition.hpp"

namespace llmt {

/// Why growth ended.
enum class StopReason {
  max_leaves,       ///< FitOptions::max_leaves reached
  significance,     ///< no leaf has a split that passes the F test
  variance_gain,    ///< no leaf has a split that lowers the residual variance
  leaf_samples,     ///< leaves are too small to be split, or their split inputs (M5': or outputs) are constant
  exact_fit,        ///< the leaves reproduce the outputs to rounding
  aicc,             ///< LOLIMOT and HILOMOT without folds: the corrected Akaike criterion rose
  pruning,          ///< pruning by RETIS or M5' removed the last splits
  cross_validation  ///< fewer leaves than grown had the smallest held-out error
};

/// A way to make a model from a grown tree.
struct Candidate {
  Validity validity = {};
  double jump = no_jump;  ///< of a blend, see ExpertOptions::jumps
  Estimation estimation = Estimation::as_grown;
  double ridge = 0.0;      ///< of joint estimation
  double shrinkage = 0.0;  ///< see ExpertOptions::shrinkages
  bool sparse = false;     ///< see SparseChoice
  Eigen::Index leaves = 1;

  bool operator==(const Candidate&) const = default;
};

/// A candidate and its error on the rows that took no part in making it.
struct CandidateError {
  Candidate candidate;
  /// Root mean square over all held-out rows, in the output's unit. For a shared partition each output's errors are
  /// divided by its standard deviation.
  double rmse = 0.0;
  double spread = 0.0;             ///< standard deviation of the folds' RMSE; 0 for one fold
  Eigen::VectorXd fold_rmse = {};  ///< one entry a fold
};

/// Whether predictions of an output are clamped to its range in training (docs/algorithms/guards.md, B.5), and the
/// root mean square errors on held-out rows, in the output's unit, that decided it. Every fold's model was clamped to
/// the range of its own training rows.
struct RangeGuard {
  bool taken = false;
  double rmse_without = 0.0;
  double rmse_with = 0.0;
};

/// How the splits of a tree were searched. All 0 for rules that do not compare the residual sums of squares of two
/// child models: RA, LOLIMOT, M5', HILOMOT.
struct SearchSummary {
  Eigen::Index exact_nodes = 0;   ///< nodes whose splits were all compared
  Eigen::Index binned_nodes = 0;  ///< nodes searched by bins
  Eigen::Index evaluations = 0;   ///< splits whose residual sum of squares was computed
  /// An upper bound over the nodes searched by bins: (RSS of the split found - RSS of the best split) / RSS of the
  /// node. The true value is far smaller as a rule.
  double largest_excess = 0.0;
};

/// The held-out error with a number of inputs, of the few candidates with which these numbers are compared.
struct InputStep {
  Eigen::Index inputs = 0;
  double rmse = 0.0;
};

/// The held-out error, one entry an output of a partition, of rows whose inputs the training rows of their fold do not
/// have, and of the others: what a prediction costs of new inputs, and of inputs that the table has
/// (docs/algorithms/selection.md, "Rows with equal inputs"). NaN: there are no such rows.
struct EqualRowErrors {
  Eigen::VectorXd rmse_new;
  /// Of repeats, which are held out together, the standard deviation of the rows of one setting about their mean: no
  /// model predicts another row of that setting better.
  Eigen::VectorXd rmse_known;
  Eigen::Index rows_new = 0;
  Eigen::Index rows_known = 0;  ///< 0 of repeats
};

/// How one partition was made.
struct PartitionSummary {
  std::vector<int> outputs;       ///< columns that the partition serves
  Eigen::Index leaves = 0;        ///< in the model
  Eigen::Index grown_leaves = 0;  ///< before the choice by cross-validation
  StopReason stop = StopReason::leaf_samples;
  /// Leaves whose rows do not determine all coefficients; these keep their parent's slopes. 0 for sparse models.
  Eigen::Index rank_deficient_leaves = 0;
  Eigen::Index coefficients = 0;  ///< of all leaves, for one output: constants and slopes that are not 0
  Eigen::VectorXd train_rmse;     ///< in-sample, one entry an output of the partition, in its unit
  CandidateError chosen;          ///< as in the model, clamped if a range_guard is taken; errors NaN without folds
  /// The alternatives: least squares first, then the best candidate of each validity and width, none of them clamped.
  /// Empty without folds.
  /// From 50 000 rows on, all blends but the best one are made from samples of the training rows.
  std::vector<CandidateError> best_of_kind;
  /// Held-out RMSE of the crisp trees with 1, 2, ... leaves; empty without folds.
  Eigen::VectorXd crisp_cv_rmse;
  Eigen::Index cv_folds = 0;       ///< folds that were held out
  Eigen::Index held_out_rows = 0;  ///< rows that the errors are from, over all folds; at most 10 000 of each fold
  SearchSummary search;            ///< of the tree grown on all rows
  std::vector<int> left_out;       ///< inputs that FitOptions::choose_inputs left out, ascending
  /// What choose_inputs compared: all inputs first, then fewer. Empty: nothing.
  std::vector<InputStep> input_steps;
  std::vector<RangeGuard> range_guards = {};      ///< one an output of the partition; empty without folds
  std::optional<EqualRowErrors> equal_rows = {};  ///< none: no two rows have equal inputs, or there are no folds
};

/// Which inputs are codes, that is, categories given as numbers (docs/algorithms/codes.md):
/// TrainingData::may_have_codes.
struct CodeChoice {
  std::vector<int> compared = {};  ///< inputs that were compared in both forms, ascending
  std::vector<int> taken = {};     ///< those that are categories in the model, ascending
  /// One list an input: its codes, ascending; empty for the others. No lists if none is taken.
  std::vector<std::vector<double>> codes = {};
  /// The held-out error of the few candidates with which this is compared; relative to that of numbers where there are
  /// several partitions.
  double rmse_as_numbers = 0.0;
  double rmse_as_codes = 0.0;  ///< of those taken; as numbers if none is
};

struct FitSummary {
  Eigen::Index samples = 0;           ///< rows of positive weight that the model is fitted to, copies included
  Eigen::Index copies = 0;            ///< rows that were taken for copies of others and only add to their weight
  bool repeats = false;               ///< rows with equal inputs were taken for repeats, and held out together
  Eigen::Index missing_values = 0;    ///< in the inputs
  Eigen::Index min_leaf_samples = 0;  ///< as used
  std::vector<PartitionSummary> partitions;
  bool quadratic = false;  ///< whether the local models have products
  CodeChoice codes = {};
  /// LocalTerms::automatic: the best candidate with the terms that were not taken, one entry a partition. Else empty.
  std::vector<CandidateError> other_terms = {};
  /// Loss::tukey: the weight in [0, 1] that each row had by its residual, 0 for outliers. Else empty. Errors leave out
  /// rows of weight 0; all others count in full there, times TrainingData::weights.
  Eigen::VectorXd loss_weights = {};
  /// The rows that each fold held out, ascending, in the order of Intervals::models(): the model of a fold has not seen
  /// the rows of its list. Copies of a row are in the list of the row that they copy, and repeats of a measurement in
  /// one list; rows of weight 0, and those that Loss::tukey leaves out, are in none. A row whose weight counts it more
  /// than once may be in several. With one fold held out once (many rows, or TrainingData::held_out) the lists do not
  /// cover all rows. Empty without folds.
  std::vector<std::vector<Eigen::Index>> held_out = {};
};

/// What ended growth, in a few words: "the significance test".
std::string describe(StopReason reason);

}  // namespace llmt
