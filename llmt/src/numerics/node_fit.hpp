/// \file
/// Least squares in one node, on which the split search and the local models are built.
#pragma once

#include <Eigen/Core>

#include "base/matrix.hpp"
#include "numerics/gram.hpp"

namespace llmt {

/// Weighted least squares of residuals on [1, X] over the rows of a node.
///
/// Columns of X are centred, scaled to unit variance in the node and orthogonalised, so that no digits are lost by
/// offsets, scales or collinearity of the inputs. They are orthogonalised by a Cholesky factor of their correlation
/// matrix or, if that is ill-conditioned, by column-pivoted Householder QR. See docs/algorithms/numerics.md.
struct NodeFit {
  /// Constant, regressors and residuals, times the root of the row's weight. The regressors are orthogonal columns of
  /// weighted mean square 1 that span X without its mean; the residuals are those of the fit.
  Features features;
  Eigen::VectorXd rss;            ///< weighted sum of squares of each output's residuals
  Eigen::VectorXd mean;           ///< of the columns of X, over the rows that have a value
  Eigen::VectorXd low;            ///< smallest value of each column; its mean if there is none
  Eigen::VectorXd high;           ///< largest value
  Eigen::VectorXd centre_change;  ///< of the local models' value at `origin`, one per output
  /// Change of the local models' slopes, outputs x columns of X; of minimum norm in scaled columns.
  Eigen::MatrixXd slope_change;
  int rank = 1;  ///< of [1, X] over these rows, the constant included

  Eigen::MatrixXd residuals() const;  ///< rows x outputs, without the root of the weight
};

/// Fits `residuals` (rows x outputs) on [1, x] (x: rows x regressors, as deviations from the point `origin` of the
/// caller; NaN: missing, taken as the mean of its column). The change of value is that at deviation 0. At least one
/// row; weights are positive.
NodeFit fit_node(const RowMajor& x, const Eigen::MatrixXd& residuals, const Eigen::VectorXd& weights);

}  // namespace llmt
