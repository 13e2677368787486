/// \file
/// The linear model of a node of M5': least squares with few inputs (docs/algorithms/m5.md, "Models").
#pragma once

#include <Eigen/Core>

#include "numerics/node_fit.hpp"

namespace llmt {

/// Estimate of the error on new rows from the root mean square residual `error` of n rows and v coefficients:
/// error (n + 2 v) / (n - v), or 10 error if there are no more rows than coefficients (Quinlan 1992; the factors are
/// those of Wang & Witten 1997).
double adjusted_error(double error, double n, double v);

/// value + slope . x.
struct FewInputsModel {
  double value = 0.0;     ///< at x = 0
  Eigen::VectorXd slope;  ///< 0 where a column was dropped
  int coefficients = 1;   ///< that are left, the constant included
  Eigen::VectorXd residuals;
  double rms = 0.0;  ///< weighted root mean square of the residuals
};

/// Weighted least squares of y on [1, x] with as few columns as possible. Constant and collinear columns are left out.
/// Of the others the column whose loss raises the sum of squares least is dropped as long as the adjusted error (Q.2)
/// does not rise, and until there are more rows than coefficients. No value may be missing; weights must be positive.
FewInputsModel fit_few_inputs(const RowMajor& x, const Eigen::VectorXd& y, const Eigen::VectorXd& weights);

}  // namespace llmt
