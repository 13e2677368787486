/// \file
/// What a caller may ask of fit(). Defaults that depend on the data: default_text().
///
///     llmt::FitOptions options;
///     options.validity = llmt::ValidityChoice::crisp;
///     options.max_leaves = 8;
///     options.folds.kind = llmt::FoldKind::contiguous;
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/folds.hpp"
#include "llmt/limits.hpp"
#include "llmt/names.hpp"

namespace llmt {

/// Inputs, outputs and weights beyond this magnitude are refused, so that squares stay finite.
inline constexpr double largest_magnitude = bound(Limit::magnitude);
/// With quadratic local models: squares of products of inputs stay finite.
inline constexpr double largest_factor = bound(Limit::quadratic_magnitude);
/// A column whose largest magnitude is below this, and not 0, is refused, so that squares do not vanish.
inline constexpr double smallest_magnitude = 1e-140;
/// A categorical input may have this many categories.
inline constexpr int most_categories = most(Limit::categories);

/// How a tree is grown. docs/algorithms.md has a page for each rule. A leaf is split into two children by a threshold
/// on one input, or by a plane. RSS: residual sum of squares of the local models.
enum class GrowthRule {
  /// Batch-RD (Potts & Sammut 2005): best-first growth. The split with the smallest RSS of the two children is made if
  /// it passes the F test of Chow (1960) at the level FitOptions::significance.
  rd,
  /// RETIS (Karalic 1992): the splits of rd without a test, then pruned from the leaves up by m-estimates of the error.
  retis,
  /// LOLIMOT (Nelles 2001, ch. 13): the local model with the largest error is halved along the input that leaves the
  /// smallest error of the whole model. The validities are Gaussians. Without folds, AICc (the corrected Akaike
  /// criterion) decides how many leaves stay.
  lolimot,
  lolimot_data_driven,  ///< LOLIMOT with the threshold that leaves two crisp local models the smallest RSS
  /// Residual analysis (SUPPORT, Chaudhuri et al. 1994): the rows of a node are divided by the sign of their residual.
  /// The input on which the two classes differ most significantly is split at the mean of the class means. The split
  /// must pass the F test of rd. No threshold is searched.
  ra,
  /// M5' (Quinlan 1992, Wang & Witten 1997): splits by the decrease of the outputs' standard deviation. Local models
  /// drop inputs, are pruned from the leaves up, and are smoothed along the path to the root. Leaves are always crisp.
  m5,
  /// HILOMOT (Nelles 2006): the local model with the largest error is split by a plane of any direction. The plane has
  /// a logistic gate, found by nonlinear optimisation. Without folds and max_leaves, AICc decides how many leaves stay.
  hilomot
};

/// The order in which the splits of a grown tree are undone when fewer leaves predict held-out rows better.
enum class Pruning {
  last_splits,  ///< the splits that were made last go first
  /// Weakest-link (cost-complexity) pruning (Breiman et al. 1984, ch. 3): the branch whose splits lower the RSS least,
  /// in the mean over its splits, goes first. The tree is grown to three times max_leaves before it is pruned.
  weakest_link
};

/// How leaves share the input space.
enum class ValidityChoice {
  automatic,  ///< crisp or blend: the one with the smaller held-out error
  crisp,      ///< each leaf holds in its box alone; the prediction jumps at splits
  blend,      ///< smooth transitions at the splits
  gaussian    ///< normalised Gaussians over the boxes
};

/// What local models are made of.
enum class LocalTerms {
  linear,  ///< a constant and one slope for each regression input
  /// Also products and squares of the d numeric regression inputs: (d + 1) (d + 2) / 2 coefficients. d is at most 13,
  /// magnitudes of inputs at most 1e70. An input that never varies has no product, one with two values no square.
  quadratic,
  /// Fits both on the same folds and keeps the smaller held-out error. Linear without folds, and with more than 13
  /// numeric regression inputs.
  automatic
};

/// Whether a local model keeps only the regressors that its own rows support. They are chosen by forward selection with
/// orthogonal least squares, which stops where AICc is smallest. The other slopes are exactly 0.
enum class SparseChoice {
  never,
  automatic,  ///< full and sparse local models are compared by held-out error; full without folds
  always
};

/// How RD and RETIS search the best split of a node.
enum class SplitSearch {
  automatic,  ///< exact below 200 000 rows, binned from there on
  exact,      ///< finds the threshold with the smallest RSS among all
  /// Inputs are cut into at most 256 bins, once for the tree, and only thresholds between bins are compared.
  /// SearchSummary::largest_excess bounds what that loses. Nodes below 2000 rows are searched exactly. So are data with
  /// missing values or with inputs of more than 256 levels.
  binned
};

/// What a fit makes small.
enum class Loss {
  squared,  ///< squares of the residuals
  /// Squares of the residuals, each row weighted by Tukey's biweight of its residual from a preliminary tree. Rows
  /// whose output is far from that tree count nothing. Fits two small trees more.
  tukey
};

/// What the local models of a partition are fitted to.
enum class Estimation {
  as_grown,  ///< least squares of the rows in the leaf's box, whatever the validities
  local,     ///< each leaf for itself, its rows weighted by its validity
  joint      ///< all leaves at once, with a ridge towards the local estimate
};

/// What is asked of the outputs as an input rises (docs/algorithms/constraints.md).
enum class Trend {
  any,
  rising_slopes,   ///< no slope in this input is negative, in any local model; says nothing of jumps between leaves
  falling_slopes,  ///< no slope in this input is positive
  rising,          ///< no output falls, anywhere in the input space; includes rising_slopes
  falling          ///< no output rises
};

/// An entry of ExpertOptions::jumps: every split has a transition.
inline constexpr double no_jump = std::numeric_limits<double>::infinity();

/// FitOptions::significance at which every split is made that has room for two local models.
inline constexpr double every_split = std::numeric_limits<double>::infinity();

/// Options that people rarely turn. Lists are candidates: the smallest held-out error decides among them, and without
/// folds the first entry is taken. An empty list stands for the default, see
/// default_text().
struct ExpertOptions {
  SplitSearch search = SplitSearch::automatic;
  Estimation estimation = Estimation::joint;
  /// Validity::width. Blend: width of a transition by the smaller child's extent. Gaussian: k_sigma. hilomot: factor on
  /// the half widths of the gates.
  std::vector<double> widths = {};
  /// Blend: splits where the output jumps by at least this multiple of the residual standard deviation near the split
  /// have no transition. no_jump: all splits have one.
  std::vector<double> jumps = {};
  /// Joint estimation: weight of the ridge. 0 is global least squares; larger values draw to the local estimate.
  std::vector<double> ridges = {};
  /// A leaf's local model is drawn to its parent's as if this many further rows of the leaf lay on the parent's.
  std::vector<double> shrinkages = {};
};

/// The options of a fit. Column indices count from 0. A further member needs an entry in option_fields.hpp.
struct FitOptions {
  GrowthRule rule = GrowthRule::rd;
  Eigen::Index max_leaves = 0;        ///< largest number of leaves of a tree; 0: see default_text()
  Eigen::Index min_leaf_samples = 0;  ///< smallest number of rows in a leaf; 0: see default_text()
  /// rd, ra: a split is made if its p-value times the number of candidate splits (Bonferroni) is below this level.
  /// 1 or more: no test, but the residual variance must not rise. every_split: not even that. Negative: 0.05 for a
  /// crisp tree, see default_text().
  double significance = -1.0;
  std::vector<int> split_inputs = {};       ///< columns that may be split; empty: all
  std::vector<int> regression_inputs = {};  ///< columns that local models use; empty: all
  /// Leave out inputs where that lowers the held-out error beyond chance: RD, RETIS and RA, with two folds or more or
  /// with TrainingData::held_out, and fewer than 300 rows an input, where neither split_inputs nor regression_inputs
  /// nor a monotone trend is given.
  bool choose_inputs = true;
  bool shared_partition = false;  ///< one tree for all outputs, their RSS divided by their variances; else one each
  Pruning pruning = Pruning::last_splits;
  ValidityChoice validity = ValidityChoice::automatic;
  LocalTerms terms = LocalTerms::linear;
  Loss loss = Loss::squared;
  SparseChoice sparse = SparseChoice::never;
  /// The tree is grown anew in every fold, and what predicts the held-out rows best is kept. count 0: no choice, the
  /// tree stays as grown. From 50 000 rows on, only the first fold is held out. TrainingData::held_out takes their
  /// place.
  FoldOptions folds = {};
  std::vector<Trend> trends = {};  ///< one an input; empty: any
  bool intervals = true;           ///< keep the folds' models and residuals for prediction intervals
  int max_threads = 0;             ///< 0: all that the machine has. The result does not depend on it
  ExpertOptions expert = {};
};

/// The default of an option whose default depends on the case, in words: "1 where blends or Gaussians are candidates;
/// ...; else 0.05". `option`: "max_leaves", "min_leaf_samples", "significance", "widths", "jumps", "ridges" or
/// "shrinkages"; throws std::invalid_argument for others. docs/options.md has these texts too.
std::string default_text(std::string_view option);

/// A rule's name for people: "LOLIMOT with thresholds from the data". Throws as summary_of().
std::string_view title_of(GrowthRule rule);

/// One phrase for help: "no test, pruned by m-estimates". Throws std::invalid_argument for a number that is no rule.
std::string_view summary_of(GrowthRule rule);

/// Whether a rule prunes, drops inputs and smooths by itself, so that its local models are not estimated anew (M5').
bool has_own_models(GrowthRule rule);

// Names, see names.hpp.
template <>
std::span<const Choice<GrowthRule>> choices();
template <>
std::span<const Choice<ValidityChoice>> choices();
template <>
std::span<const Choice<LocalTerms>> choices();
template <>
std::span<const Choice<SparseChoice>> choices();
template <>
std::span<const Choice<SplitSearch>> choices();
template <>
std::span<const Choice<Estimation>> choices();
template <>
std::span<const Choice<Loss>> choices();
template <>
std::span<const Choice<Pruning>> choices();
template <>
std::span<const Choice<FoldKind>> choices();
template <>
std::span<const Choice<Trend>> choices();

}  // namespace llmt
