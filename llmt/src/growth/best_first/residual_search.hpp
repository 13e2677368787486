/// \file
/// The split of a node by the signs of its residuals (docs/algorithms/residual-analysis.md).
#pragma once

#include <array>
#include <span>
#include <vector>

#include "growth/growth_data.hpp"
#include "growth/search/split_search.hpp"

namespace llmt {

/// How an input differs between the class of rows with residual >= 0 (+) and the class with residual < 0 (-): R.1.
struct ResidualStatistics {
  double positive_mean = 0.0;  ///< m+, weighted, over the rows that have a value
  double negative_mean = 0.0;  ///< m-
  /// Student's statistic of m+ - m-, with the pooled variance:
  ///   T = (m+ - m-) / (s sqrt(1 / n+ + 1 / n-)),  s^2 = (SS+ + SS-) / (n+ + n- - 2)
  /// 0 for a constant input or an empty class, infinite if there is no scatter within the classes.
  double means = 0.0;
  double variances = 0.0;  ///< Levene's statistic: the same computed from |x - mean of the row's class|
  double freedom = 0.0;    ///< n+ + n- - 2, sums of weights
  double low = 0.0;        ///< smallest value
  double high = 0.0;       ///< largest value

  /// The more significant of the two statistics as a normal deviate with the same two-sided probability. Deviates of
  /// different inputs can be compared, and do not underflow as probabilities do. Wallace (1959): with f degrees of
  /// freedom, (8 f + 1) / (8 f + 3) sqrt(f log(1 + t^2 / f)).
  double deviate() const;
};

/// `values`: of the input, NaN where missing. Weights are positive.
ResidualStatistics residual_statistics(std::span<const double> values, std::span<const double> residuals,
                                       std::span<const double> weights);

/// Rows of a node, in features whose residuals are those of a model that need not be the node's own.
struct ResidualNode {
  SearchNode search;                 ///< features and the node's residual sum of squares
  std::span<const int> rows;         ///< of the features
  const Eigen::MatrixXd& values;     ///< of the split inputs in these rows, rows x split inputs; NaN: missing
  const Eigen::MatrixXd& residuals;  ///< of the node's own model, rows x outputs; only their signs count
  const Eigen::VectorXd& weights;    ///< of the rows
  std::span<const double> gram;      ///< of the rows, if it is known and no value is missing; else empty
  int threads = 1;
};

/// A split by residuals. `best.last_left` is the threshold: values up to it go left.
struct ResidualSplit {
  SplitCandidate best;
  std::array<std::vector<int>, 2> sides;     ///< positions among the node's rows of those that go left and right
  std::array<std::vector<double>, 2> grams;  ///< and their Gram matrices
};

/// Splits the numeric input whose classes differ most significantly, over all outputs, at (m+ + m-) / 2 (R.2). If that
/// leaves too few rows on a side or does not pass the F test at 5 %, the next input is tried: a product of two inputs
/// leaves signs that depend on neither of them alone. If no split passes, the one with the smallest adjusted RSS is
/// returned. Of inputs that are equally significant to nine digits the first one is taken. `best.tested` counts the
/// pairs of input and output that could be tested. Cost: one pass over the values of each input, and for each split
/// that is tried one pass over the values and one over the features.
ResidualSplit search_by_residuals(const GrowthData& data, const ResidualNode& node);

/// Gram matrix of some rows of features.
std::vector<double> sum_gram(const Features& features, std::span<const int> rows, int threads);

}  // namespace llmt
