/// \file
/// Least squares in one node: what the split search and the local models are built on.
#pragma once

#include <Eigen/Core>

#include "base/matrix.hpp"
#include "numerics/gram.hpp"

namespace llmt {

/// Weighted least squares of residuals on [1, X] over the rows of a node.
///
/// Columns of X are centred, scaled to unit variance in the node and orthogonalised, so that neither offsets, nor
/// scales, nor collinearity of the inputs cost digits: by a Cholesky factor of their correlation matrix, or, if that is
/// ill-conditioned, by column-pivoted Householder QR. See docs/algorithms.md.
struct NodeFit {
  /// Constant, regressors and residuals, times the root of the row's weight. The regressors are orthogonal columns of
  /// weighted mean square 1 that span X without its mean; the residuals are what the fit leaves.
  Features features;
  Eigen::VectorXd rss;            ///< weighted sum of squares of each output's residuals
  Eigen::VectorXd mean;           ///< of the columns of X, over the rows that have a value
  Eigen::VectorXd low;            ///< smallest value of each column; its mean if there is none
  Eigen::VectorXd high;           ///< largest value
  Eigen::VectorXd centre_change;  ///< of the local models' value at `origin`, one per output
  Eigen::MatrixXd
      slope_change;  ///< of the local models' slopes, outputs x columns of X; of minimum norm in scaled columns
  int rank = 1;      ///< of [1, X] over these rows, the constant included

  Eigen::MatrixXd residuals() const;  ///< rows x outputs, without the root of the weight
};

/// Fits `residuals` (rows x outputs) on [1, x] (x: rows x regressors, as deviations from the point `origin` of the
/// caller; NaN: missing, taken as the mean of its column). The change of value is that at deviation 0. At least one
/// row; weights are positive.
NodeFit fit_node(const RowMajor& x, const Eigen::MatrixXd& residuals, const Eigen::VectorXd& weights);

/// Pivots below this, relative to the largest one, count as zero: columns that agree to about ten digits are collinear.
inline constexpr double rank_tolerance = 1e-10;

}  // namespace llmt
