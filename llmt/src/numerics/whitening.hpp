/// \file
/// Passes over rows of features: to change the basis of the regressors, and to subtract a fit from the residuals.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "numerics/gram.hpp"

namespace llmt {

/// Replaces the regressors z of every row by z W. `matrix` is the upper triangular W, row by row, each row padded with
/// zeros to a multiple of eight.
void transform_regressors(Features& features, const std::vector<double>& matrix);

/// The residuals after subtract_fit().
struct Remainder {
  std::vector<double> products;  ///< sum of the remaining residual times constant and regressors
  double squares = 0.0;          ///< sum of its squares
};

/// Subtracts [1, z] . coefficients from the residuals of an output.
Remainder subtract_fit(Features& features, Eigen::Index output, const std::vector<double>& coefficients);

/// The inverse square root of a covariance matrix, on the directions that have variance: forward' covariance forward is
/// the identity, and covariance = back back'.
struct Whitening {
  Eigen::MatrixXd forward;
  Eigen::MatrixXd back;
  Eigen::Index rank = 0;
};

/// Whitens by a covariance matrix. A direction whose variance is at most `collinearity_tolerance` times the largest
/// counts as none.
Whitening whiten(const Eigen::MatrixXd& covariance);

}  // namespace llmt
