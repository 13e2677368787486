/// \file
/// How large the errors of a model are near a row, for prediction intervals: a small tree.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/partition.hpp"

namespace llmt {

/// A node of a spread: a split, or a leaf.
struct SpreadNode {
  int column = 0;             ///< of a split: an input; the number of inputs stands for the prediction
  double threshold = 0.0;     ///< a value of at most this goes to the left; of a category, the value of its level
  bool missing_left = false;  ///< side of rows whose value is missing
  int left = -1;              ///< index of a later node; -1: a leaf
  int right = -1;             ///< as `left`
  double factor = 1.0;        ///< of a leaf: mean absolute error of its rows, divided by that of all rows

  bool is_leaf() const { return left < 0; }
  bool operator==(const SpreadNode&) const = default;
};

/// The spread sigma(x, w) of the errors of a model relative to their mean size, at a row x of weight w:
///   sigma(x, w)^2 = factor(x)^2 (1 - r + r w0 / w),
/// where r is the share of the squared errors that is noise of the variance 1 / w, and w0 a usual weight. Without nodes
/// the factor is 1 everywhere.
struct Spread {
  std::vector<SpreadNode> nodes = {};  ///< the first one is the root
  /// One list an input: of a category the value of each of its levels and, last, that of any other one; empty for
  /// numbers. Empty without nodes.
  std::vector<std::vector<double>> levels = {};
  double noise_share = 0.0;   ///< r, from 0 to 1; 0: errors do not depend on the weight
  double usual_weight = 1.0;  ///< w0: the median weight of the held-out rows

  /// Whether it is 1 everywhere.
  bool is_even() const { return nodes.empty() && noise_share == 0.0; }
  bool operator==(const Spread&) const = default;
};

/// The spread at a row of `inputs` and of the usual weight, whose model predicts `prediction` there. Categories are
/// positions in their levels, also those of empty cells that are a level: with_empty_levels().
double spread_at(const Spread& spread, const Eigen::Ref<const Eigen::MatrixXd>& inputs, Eigen::Index row,
                 double prediction);

/// What the spread of a row of this weight is times that of a row of the usual weight.
double factor_of_weight(const Spread& spread, double weight);

/// Throws std::invalid_argument, beginning with `what`, unless there is no weight or one for each of `rows` rows, each
/// finite and positive.
void check_row_weights(const char* what, const Eigen::VectorXd& weights, Eigen::Index rows);

/// `inputs` with the position of the level of empty cells in their place, where a column has such a level.
Eigen::MatrixXd with_empty_levels(const std::vector<InputColumn>& columns,
                                  const Eigen::Ref<const Eigen::MatrixXd>& inputs);

/// Throws std::invalid_argument if a spread does not fit a model with these inputs: a number of lists or of values, a
/// tree that is none, a column out of range, a number that is not finite, a factor that is not positive or beyond a
/// million, a share beyond 0 to 1, a weight that is not positive.
void check_spread(const Spread& spread, const std::vector<InputColumn>& inputs);

}  // namespace llmt
