/// \file
/// Passes over rows of features: changing the basis of the regressors, and taking a fit off the residuals.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "numerics/gram.hpp"

namespace llmt {

/// Replaces the regressors z of every row by z W. `matrix` is W, upper triangular, row by row, each row filled up with
/// zeros to a multiple of eight.
void transform_regressors(Features& features, const std::vector<double>& matrix);

/// What subtract_fit() leaves.
struct Remainder {
  std::vector<double> products;  ///< sum of the remaining residual times constant and regressors
  double squares = 0.0;          ///< sum of its squares
};

/// Takes [1, z] . coefficients off the residuals of an output.
Remainder subtract_fit(Features& features, Eigen::Index output, const std::vector<double>& coefficients);

/// A pseudo-inverse square root: columns that make a covariance the identity on the directions that there are.
struct Whitening {
  Eigen::MatrixXd forward;
  Eigen::MatrixXd back;
  Eigen::Index rank = 0;
};

/// Of a covariance matrix; directions whose variance is below `covariance_tolerance` of the largest count as none.
Whitening whiten(const Eigen::MatrixXd& covariance);

/// The digits that a sum of squares has.
inline constexpr double covariance_tolerance = 1e-10;

}  // namespace llmt
