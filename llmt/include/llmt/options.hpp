/// \file
/// What a caller may ask of fit().
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/folds.hpp"

namespace llmt {

/// When a leaf is split, and how the tree is pruned. RD and RETIS look at every threshold of every split input and take
/// the one with the smallest residual sum of squares of the two child models. That sum is the same anywhere in the gap
/// between two training values; the threshold goes where the child models meet, or in the middle if they do not meet in
/// the gap. RD, RETIS and RA grow best-first: the split that lowers the sum most comes next.
enum class GrowthRule {
  /// Batch-RD (Potts & Sammut 2005): a split must pass the F test of Chow (1960),
  ///   F = [(RSS_0 - RSS_1 - RSS_2) / (p_1 + p_2 - p_0)] / [(RSS_1 + RSS_2) / (N - p_1 - p_2)]
  /// with p the ranks (p_1 + p_2 - p_0 = p for full rank), and lower the residual variance, RSS_0 / (N - p_0) -
  /// (RSS_1 + RSS_2) / (N - p_1 - p_2), by a given amount.
  rd,
  /// RETIS (Karalic 1992): minimises the weighted mean squared error (n_1 MSE_1 + n_2 MSE_2) / N without a test, then
  /// prunes from the
  /// leaves up with m-estimates of the error.
  retis,
  /// LOLIMOT (Nelles 2001, ch. 13): the worst local model is halved along the input that leaves the smallest error of
  /// the whole model with Gaussian validities; the two new models are estimated locally. Takes
  /// BlendOptions::widths (k_sigma, 1/3) and Estimation: as_grown and local are Nelles' local estimation, joint his
  /// global one. Without folds AICc decides how many leaves stay.
  lolimot,
  lolimot_data_driven,  ///< LOLIMOT with thresholds where two crisp models of the box's rows leave the smallest error
  /// Residual analysis (SUPPORT, Chaudhuri et al. 1994; Potts & Sammut 2005): the rows of a node fall into two classes
  /// by the sign of their residual, the input whose class means m+, m-, or whose scatter about them, differ most
  /// significantly is split at (m+ + m-) / 2. The split must pass the tests of RD; if it does not, the next input is
  /// tried. Nothing is sorted and no threshold searched: a split that is tried costs O(rows x coefficients^2).
  ra,
  /// M5' (Quinlan 1992, Wang & Witten 1997): splits by the decrease of the outputs' scatter, down to a few rows; a
  /// node's model has the inputs tested below it, less those that do not pay; pruned from the leaves up by
  /// the adjusted error err (n + 2 v) / (n - v), v coefficients; models smoothed along the path to the root,
  /// (n p + 15 q) / (n + 15). Crisp, with models of its own: blends, Gaussians and shrinkages are refused.
  m5,
  /// HILOMOT (Nelles 2006): the worst local model is split by a plane of any direction with a logistic gate, found by
  /// nonlinear optimisation with the two local models nested inside; validities are products of gates. Takes
  /// BlendOptions::widths (of the gates, 1: as grown) and Estimation as lolimot does; ValidityChoice automatic or
  /// crisp. Without folds and GrowthOptions::max_leaves AICc decides how many leaves stay.
  hilomot
};

/// How RD and RETIS search the best split of a node.
enum class SplitSearch {
  automatic,  ///< exact, by bins for many rows
  exact,      ///< every threshold counts; those that cannot be the best are passed over, see docs/algorithms.md
  /// Inputs are cut into at most 256 bins, once for the tree, and only the edges between bins are compared;
  /// SearchSummary::largest_excess says how far from the best split that can be at most. Nodes of few rows are searched
  /// exactly. Data with missing values, or with inputs of more than 256 levels, are searched exactly too.
  binned
};

/// In which order the splits of a grown tree are undone where fewer leaves predict held-out rows better.
enum class Pruning {
  last_splits,  ///< the last that best-first growth made come first
  /// Weakest-link (cost-complexity) pruning of Breiman et al. (1984, ch. 3): the branch whose splits lower the residual
  /// sum of squares least, in the mean over its splits. So a split stays for what the splits below it gain, which
  /// best-first growth cannot know when it makes it. Within a branch in the order that makes the sum of the residual
  /// sums of squares of all pruned trees smallest, see docs/algorithms.md.
  weakest_link
};

struct GrowthOptions {
  GrowthRule rule = GrowthRule::rd;
  /// rd, ra: a split is accepted if P(F >= observed), times the number of candidate splits it was chosen from
  /// (Bonferroni: the maximum over many candidates does not follow the F distribution), is below this. 1 or more: no
  /// test. Negative: 0.05 for a crisp tree, no test where blends are among the candidates, for the held-out error
  /// decides then and the joint estimate bears far more leaves than a crisp one.
  double significance = -1.0;
  /// rd, ra: smallest decrease of the residual variance, as a fraction of the variance of the output. 0: any decrease;
  /// negative: no demand.
  double min_variance_gain = 0.0;
  /// Smallest number of rows in a leaf. 0: twice the number of coefficients of a local model for a crisp tree, 2 for
  /// M5'; where blends are among the candidates as many as regressors, at least 5.
  Eigen::Index min_leaf_samples = 0;
  /// Largest number of leaves of a partition. 0: no limit for a crisp tree; where blends are among the candidates as
  /// many as make 1500 coefficients, within 20 ... 400.
  Eigen::Index max_leaves = 0;
  /// Growth ends when further splits lower the residual sum of squares of the whole tree by less than this fraction
  /// each, in the geometric mean over the next ten splits of best-first growth; those are not kept.
  /// Benes et al. (2022) stop at "less than 2 %" without saying of what; this is our reading, docs/algorithms.md gives
  /// the reason. 0: off. Not for M5', which prunes.
  double min_improvement = 0.0;
  /// One partition for all outputs (their residual sums of squares added after division by the output's variance)
  /// instead of one each.
  bool shared_partition = false;
  /// Columns that may be split, and columns that local models use. Empty: all.
  std::vector<int> split_inputs = {};
  std::vector<int> regression_inputs = {};
  SplitSearch search = SplitSearch::automatic;
  /// Order in which splits are undone: down to max_leaves from three times as many (not LOLIMOT), then by held-out
  /// error. RETIS undoes those that its m-estimates reject before. With weakest_link and folds a crisp tree has other
  /// defaults: `significance` no test, so that splits that only help later ones stay, `max_leaves` 1000.
  Pruning pruning = Pruning::last_splits;
};

/// What the local models of a partition are fitted to.
enum class Estimation {
  as_grown,  ///< least squares of the rows in the leaf's box, whatever the validities
  local,     ///< each leaf for itself, rows weighted by its validity
  joint      ///< all leaves at once, see BlendOptions::ridges
};

/// Which validities are candidates.
enum class ValidityChoice {
  automatic,  ///< crisp and blends: the one with the smallest held-out error
  crisp,
  blend,
  gaussian
};

/// See BlendOptions::jumps.
inline constexpr double no_jump = std::numeric_limits<double>::infinity();

/// How leaves share the input space. Lists are candidates, of which the smallest held-out error decides; without
/// folds their first entries are taken.
struct BlendOptions {
  ValidityChoice validity = ValidityChoice::automatic;
  Estimation estimation = Estimation::joint;
  std::vector<double> widths = {};  ///< Validity::width. Empty: 0.5, 1, 2 and, but for a single
                                    ///< hold-out, 4 for blends, with monotone inputs 0.25, 0.5, 1, 2; 1/3 for
                                    ///< Gaussians; 1, 2, 4 for logistic gates
  /// Splits where the outputs jump by at least this multiple of the scatter of the rows there have no transition, see
  /// docs/algorithms.md; no_jump: all have one. Empty: no_jump, 4, 2, 1, 0.5.
  std::vector<double> jumps = {};
  /// Joint estimation: ridge, see docs/algorithms.md; 0 is global least squares, the larger the nearer to local
  /// estimation. Empty: 1e-8, 1e-6, 1e-4, 1e-2 and, but for a single hold-out, 1e-3, 1e-1.
  std::vector<double> ridges = {};
  /// Local models are drawn towards their parents' as if this many further rows said so, with the variance that each
  /// column has in the leaf and without correlation: a guard against near-collinear columns and few rows. Empty: 0, 0.1
  /// and 1; 0 without folds.
  std::vector<double> shrinkages = {};
};

/// What local models are made of.
enum class LocalTerms {
  linear,  ///< a constant and the regressors
  /// Also the products and squares of the numeric regression inputs (see Regressor): (d + 1) (d + 2) / 2 coefficients
  /// for d inputs, at most 13, of magnitudes up to 1e70. None of an input that never varies, no square of one with two
  /// values.
  quadratic,
  /// The whole selection runs for both on the same folds, and the smaller held-out error decides; but linear least
  /// squares stays as in SelectionOptions. Linear without folds, and with more numeric regression inputs than quadratic
  /// ones allow.
  automatic
};

/// Whether each local model keeps only the regressors that its own rows ask for: forward selection by orthogonal least
/// squares, the one that lowers the weighted sum of squares most first, stopped where AICc is smallest. The slopes of
/// the others are exactly 0, in joint estimation too. Trees are grown with full models. Not with Estimation::as_grown
/// where leaves overlap.
enum class SparseChoice {
  never,
  automatic,  ///< full and sparse ones are candidates, and the held-out error decides; without folds full ones
  always
};

struct LocalModelOptions {
  LocalTerms terms = LocalTerms::linear;
  SparseChoice sparse = SparseChoice::never;
};

/// How leaf count, validity, width and ridge are chosen: the tree is grown anew in every fold, and what predicts the
/// held-out rows best is taken; but least squares stays if the gain on it is not more than two standard errors of the
/// folds' paired differences, for the best of many candidates gains a little on noise too.
struct SelectionOptions {
  /// count = 0: no choice, the tree stays as grown. Fewer groups than folds: one fold per group. From 50000 rows on,
  /// one fold is held out once instead of every fold in turn.
  FoldOptions folds = {};
};

struct FitOptions {
  GrowthOptions growth = {};
  LocalModelOptions local_models = {};
  BlendOptions blend = {};
  SelectionOptions selection = {};
  /// Columns of `inputs` whose values are categories 0, 1, 2, ...: split into sets of categories, and offsets in the
  /// local models.
  std::vector<int> categorical_inputs = {};
  /// Of each input, -1, 0 or 1: the sign that its slope has in every local model, or zero slope; 0: any. Says nothing
  /// of what happens from one leaf to the next. Empty: none.
  std::vector<int> slope_signs = {};
  /// Of each input, 1: no output falls when this input rises and the others stay, whatever they are (-1: none rises):
  /// within leaves, at jumps, in blends, where guards act and beyond the training extent. Includes the sign of the
  /// slopes. Exact but for the rounding of evaluation; docs/algorithms.md says how, and what it costs. Splits on such
  /// inputs are not made with Gaussian validities, nor where inputs have missing values. Model::prefix() does not keep
  /// it. Empty: none.
  std::vector<int> monotone = {};
  Eigen::VectorXd weights = {};  ///< of the rows, not negative; a row of weight 0 takes no part. Empty: all alike.
  bool intervals = true;         ///< keep the folds' models and residuals for prediction intervals
  int max_threads = 0;           ///< 0: all that the machine has. The result does not depend on it.
  /// Called after each growth (a tree of a fold, or a final one) with how many of how many are done; one call at a
  /// time, from any thread.
  std::function<void(Eigen::Index done, Eigen::Index total)> progress = {};
};

}  // namespace llmt
