/// \file
/// A partition of the input space as plain data: a tree of splits, an affine local model in every node, and what a
/// model says of its columns. docs/algorithms/model.md has the equations.
///
///     const llmt::Partition& tree = model.partitions().front();
///     const int first_split = tree.nodes.front().split_input;  // -1: the tree is one leaf
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/names.hpp"

namespace llmt {

/// How the local models of a partition share the input space. Validities are >= 0 and sum to 1 everywhere.
enum class ValidityKind {
  crisp,  ///< 1 in the leaf's own box, 0 elsewhere: the prediction jumps at the splits
  /// The hierarchical blend: at every split a transition g of compact support hands over from the left to the right
  /// child, and a leaf's validity is the product of g or 1 - g along its path. With u = (x_j - threshold) / h and
  /// v = (clamp(u, -1, 1) + 1) / 2:  g = 1 - v^2 (3 - 2 v). The prediction has one continuous derivative.
  blend,
  /// Normalised Gaussians, Phi_i = mu_i / sum mu, mu_i = exp(-1/2 sum_j ((x_j - c_ij) / sigma_ij)^2): c_ij the middle
  /// of the leaf's box, closed by the training extent, sigma_ij = width times its side (Nelles 2001; width = k_sigma).
  gaussian,
  /// Products of logistic gates along the path, as in HILOMOT (Nelles 2006): with u = (s - threshold) / h and s the
  /// side of the split, see Node, the left child has the share g = 1 / (1 + exp(u)) and the right one 1 - g.
  logistic
};

template <>
std::span<const Choice<ValidityKind>> choices();

struct Validity {
  ValidityKind kind = ValidityKind::crisp;
  /// blend: h as a multiple of the distance from the threshold to the nearer side of the node's box (the extent of the
  /// smaller child), for splits on numbers; gaussian: k_sigma; logistic: h as a multiple of that of growth. 0 for
  /// crisp.
  double width = 0.0;

  bool operator==(const Validity&) const = default;
};

/// One node of a partition's tree, inner or leaf. Inner nodes keep a local model of their own.
///
/// A split compares s(x) with its threshold: s = x[split_input], or in an oblique one
///   s = sum_j direction_j (x_j - c_j),  c: InputColumn::centre
/// where a missing value counts as its centre.
struct Node {
  int left = -1;         ///< child for s <= threshold; -1 in a leaf
  int right = -1;        ///< child for s > threshold; -1 in a leaf
  int split_input = -1;  ///< column of the input that is compared, or counts most in an oblique split; -1 in a leaf
  /// In the unit of s. The largest double means: rows that have a value go left, rows without one right.
  double threshold = 0.0;
  /// Oblique split: weight of every input of the model, 0 for categorical ones, in units of 1 / the input's. A grown
  /// direction has length 1 if every input is measured by its standard deviation. Empty: axis-orthogonal.
  Eigen::VectorXd direction = {};
  /// Split on a categorical input: for each of its levels -1 left, 1 right, 0 not seen here. Empty for numbers.
  std::vector<int> level_side = {};
  double half_width = 0.0;    ///< h of the transition of a blend or a logistic gate, in the unit of s; 0: a jump
  double missing_left = 0.5;  ///< validity of the left child where the split input is missing or its level was not seen

  Eigen::Index samples = 0;  ///< training rows in the node's box
  /// Number of coefficients that the rows determine: rank of [1, regressors] over the rows. In sparse local models
  /// (FitOptions::sparse) the number of coefficients that were selected; the slopes of the others are 0.
  int rank = 0;
  Eigen::VectorXd rss;    ///< weighted residual sum of squares over those rows, one per output of the partition
  Eigen::VectorXd value;  ///< local model at the centre of the regressors, one per output of the partition
  Eigen::MatrixXd slope;  ///< d output / d regressor, outputs of the partition x regressors
  /// Mean and range of each regressor, as deviations from its centre. The mean is that over the node's rows, and stands
  /// in for a missing value. The range is that over the rows that the node's validity reaches. Beyond the range the
  /// ancestors' slopes take over (docs/algorithms/guards.md, B.2).
  Eigen::VectorXd mean;
  Eigen::VectorXd low;
  Eigen::VectorXd high;
  /// Leaves: inverse of the sum of validity * weight * a a', a = [1, deviations]; for leverages. May be empty.
  Eigen::MatrixXd inverse_gram;

  bool is_leaf() const { return left < 0; }
  bool is_oblique() const { return direction.size() > 0; }
};

/// A tree of splits that serves one or several outputs. HILOMOT makes oblique splits, all other rules axis-orthogonal
/// ones.
///
/// Nodes stand in the order of growth: node 0 is the root and the k-th split (k = 1, 2, ...) made the nodes 2k-1 (left)
/// and 2k (right). The first 2M-1 nodes are therefore the tree as it was with M leaves; with Pruning::weakest_link the
/// order is the reverse of that in which splits are undone, and they are the tree pruned to M leaves.
struct Partition {
  std::vector<int> outputs;  ///< columns of the model's outputs that this partition predicts, ascending
  Validity validity = {};
  std::vector<Node> nodes;  ///< in order of growth
  /// Slopes beyond the training extent, outputs x regressors. Empty: the root's.
  Eigen::MatrixXd outer_slope = {};
  /// Smallest and largest residual of the root's model over the training rows, outputs x 2. Predictions are held to the
  /// root's model plus this range (docs/algorithms/guards.md, B.3). Empty: they are not.
  Eigen::MatrixXd residual_range = {};
  /// Smallest and largest prediction of each output, outputs x 2, within the output's range in training. What lies
  /// outside is clamped, after all other guards (docs/algorithms/guards.md, B.5). -infinity, infinity: this output is
  /// not clamped. Empty: none is.
  Eigen::MatrixXd output_range = {};

  Eigen::Index num_leaves() const { return (std::ssize(nodes) + 1) / 2; }
};

/// What a model knows of its inputs.
struct InputColumn {
  std::string name;
  double low = 0.0;     ///< smallest training value
  double high = 0.0;    ///< largest training value
  double centre = 0.0;  ///< mean of the training values; local models are written about it
  /// Categorical input: the names of its values 0, 1, 2, ... Empty for numbers. If the last name is empty, that level
  /// is what a missing value (NaN) means: some training rows had none. Else a missing value is as an unknown category.
  std::vector<std::string> levels = {};
  /// Numbers of the levels with a name, ascending, where a row gives this categorical input as a number. Another number
  /// counts as the nearest of them, of two the smaller. Empty: a row gives the position of the level.
  std::vector<double> codes = {};

  bool is_categorical() const { return !levels.empty(); }
  bool has_empty_level() const { return is_categorical() && levels.back().empty(); }
  /// The name of a level for people: "(empty)" for that of missing values.
  std::string shown_level(std::size_t level) const { return levels[level].empty() ? "(empty)" : levels[level]; }
};

/// What a model knows of its outputs.
struct OutputColumn {
  std::string name;
  double low = 0.0;   ///< smallest training value
  double high = 0.0;  ///< largest training value
};

/// A column of the local models: a numeric input, the indicator (0 or 1) of one level of a categorical input, or the
/// product of two numeric inputs' deviations, d_i d_j with d = x - InputColumn::centre. Beyond the training extent the
/// factors of a product are held to the extent (docs/algorithms/data.md, D.1), so that products are constant there.
struct Regressor {
  int input = 0;
  int level = -1;         ///< -1 for a number
  double centre = 0.0;    ///< mean over the training rows; local models use the deviation from it
  int second_input = -1;  ///< of a product, not below `input`; else -1

  bool operator==(const Regressor&) const = default;
};

/// Partition `partition` as it was with at most `max_leaves` leaves.
Partition prefix(const Partition& partition, Eigen::Index max_leaves);

}  // namespace llmt
