/// \file
/// Least squares in one node: what the split search and the local models are built on.
#pragma once

#include <Eigen/Core>

namespace llmt {

/// Weighted least squares of residuals on [1, X] over the rows of a node.
///
/// Columns of X are centred and scaled to unit variance in the node and orthogonalised (column-pivoted Householder QR),
/// so that neither offsets, nor scales, nor collinearity of the inputs cost digits; see docs/algorithms.md.
struct NodeFit {
  Eigen::MatrixXd basis;  ///< rows x (rank - 1): orthogonal columns, of weighted mean square 1, that span X without its
                          ///< mean ("whitened" X), times the square root of the row's weight
  Eigen::VectorXd root_weights;   ///< square roots of the rows' weights
  Eigen::MatrixXd residuals;      ///< rows x outputs: what the fit leaves
  Eigen::VectorXd rss;            ///< weighted sum of squares of each column of residuals
  Eigen::VectorXd mean;           ///< of the columns of X, over the rows that have a value
  Eigen::VectorXd centre_change;  ///< of the local models' value at `origin`, one per output
  Eigen::MatrixXd
      slope_change;  ///< of the local models' slopes, outputs x columns of X; of minimum norm in scaled columns
  int rank = 1;      ///< of [1, X] over these rows, the constant included
};

/// Fits `residuals` (rows x outputs) on [1, x] (x: rows x regressors, as deviations from the point `origin` of the
/// caller; NaN: missing, taken as the mean of its column). The change of value is that at deviation 0. At least one
/// row; weights are positive.
NodeFit fit_node(const Eigen::MatrixXd& x, const Eigen::MatrixXd& residuals, const Eigen::VectorXd& weights);

/// Pivots below this, relative to the largest one, count as zero: columns that agree to about ten digits are collinear.
inline constexpr double rank_tolerance = 1e-10;

}  // namespace llmt
