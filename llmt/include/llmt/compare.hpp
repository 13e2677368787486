/// \file
/// Smooth against discontinuous trees, on the same folds.
///
///     const llmt::ComparisonResult compared = llmt::compare(inputs, outputs, llmt::usual_methods());
///     const std::string best = compared.methods[compared.recommended].method;
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/progress.hpp"

namespace llmt {

/// A way to learn, with a name for people.
struct Method {
  std::string name;
  FitOptions options;                        ///< of one tree
  std::optional<BoostOptions> boosted = {};  ///< a sum of trees in its place: fit_boosted()
};

/// The methods of `llmt compare`: least squares; the crisp tree of each growth rule that has one (RD, RETIS, RA, M5');
/// Gaussians over a crisp tree as in Benes et al. (2022), as grown and with joint estimation; the blend with joint
/// estimation; LOLIMOT; HILOMOT. `base` gives columns, folds and threads; with Pruning::weakest_link the pruned crisp
/// tree and blend are added.
std::vector<Method> usual_methods(const FitOptions& base = {});

/// Also the crisp tree with quadratic local models, where these can be made of the data. Throws std::invalid_argument
/// as fit() for names and categories.
std::vector<Method> usual_methods(const FitOptions& base, const TrainingData& data);

/// "sum of trees", by the seed and the threads of `base`.
Method boosted_method(const FitOptions& base = {});

/// Why the sum of trees is not among the methods for these rows: "--loss tukey", ...; empty: it is.
std::string why_not_boosted(const FitOptions& base, const TrainingData& data);

/// What one method made of the data.
struct Comparison {
  std::string method;
  bool is_sum = false;      ///< of trees, not one tree
  Eigen::Index trees = 1;   ///< of the model of all rows
  Eigen::Index leaves = 0;  ///< of all trees
  /// Number of constants and non-zero slopes of the local models, thresholds, directions and gates of the splits.
  Eigen::Index parameters = 0;
  Eigen::VectorXd fold_rmse = {};  ///< held-out, one entry a fold
  double cv_rmse = 0.0;            ///< over all held-out rows
  double spread = 0.0;             ///< standard deviation of fold_rmse
  /// Of all held-out rows, the share that lies within its 90 % prediction interval, and the mean of crps() over 20
  /// quantiles; weighted as the error. NaN where a fold leaves fewer than `fewest_rows_of_crps` rows to hold out
  /// within.
  double coverage = 0.0;
  double crps = 0.0;
  /// Largest change of the prediction across a split, at the training rows' projections on it (at most 1000 rows). NaN
  /// of a sum of trees.
  double largest_jump = 0.0;
  double fit_seconds = 0.0;      ///< of the model of all rows, its own selection included
  double predict_seconds = 0.0;  ///< time to predict a million rows
};

/// Held-out rows that the outermost of 20 quantiles, 0.025 and 0.975, need.
inline constexpr Eigen::Index fewest_rows_of_crps = 19;

struct ComparisonResult {
  std::vector<Comparison> methods;  ///< in the order asked for
  std::size_t recommended = 0;      ///< position in `methods`
  std::string recommendation;       ///< a sentence that says which to take and why
  /// With Loss::tukey: a weight for each row as in FitSummary::loss_weights. Rows of weight 0 count in no error,
  /// whatever the method. Empty if no method has that loss.
  Eigen::VectorXd loss_weights = {};
};

struct CompareOptions {
  FoldOptions folds = {};  ///< outer folds: each method makes all its choices within the training part
  Progress progress = {};  ///< steps have the names of the methods
};

/// Fits every method in every fold and on all rows. One output. The method with the smallest held-out error is
/// recommended, unless a simpler one is within one standard error of it (of the paired differences over the folds):
/// least squares before all others, then the crisp tree by RD. Where a method has Loss::tukey, rows that this loss
/// leaves out count in no held-out error; they are found once, on all rows, for all methods.
///
/// Throws std::invalid_argument as fit(), and if there is no method, or more than one output.
ComparisonResult compare(const TrainingData& data, const std::vector<Method>& methods,
                         const CompareOptions& options = {});

/// The comparison on matrices about whose rows and columns nothing else is known.
ComparisonResult compare(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                         const Eigen::Ref<const Eigen::MatrixXd>& output, const std::vector<Method>& methods,
                         const CompareOptions& options = {});

/// Largest change of a model's prediction across its splits, at the projections of the rows on the planes of the splits
/// whose boxes hold them: the first output of each partition, at most 1000 rows, evenly spaced.
double largest_jump(const Model& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs);

}  // namespace llmt
