/// \file
/// Equations of one node: which terms, and with which rounded coefficients.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "numerics/forward_selection.hpp"

namespace llmt {

/// y = intercept + slopes . terms, for each output.
struct Equation {
  std::vector<Eigen::Index> terms;  ///< positions, in the order of selection
  Eigen::VectorXd intercept;        ///< where all terms are 0
  Eigen::MatrixXd slope;            ///< outputs x terms
};

/// To which powers of ten coefficients are rounded, and which sign slopes keep.
struct Grains {
  std::vector<int> intercept;            ///< one exponent an output
  std::vector<std::vector<int>> slopes;  ///< of each output, one exponent a term
  std::vector<int> signs = {};           ///< of each term's slope: -1, 0 (any) or 1; empty: any
};

/// The values of terms and outputs at which the columns of sums are 0.
struct Origin {
  Eigen::VectorXd terms;
  Eigen::VectorXd outputs;
};

/// The least-squares equation in the first `count` terms of a path, rounded. `sums`: of terms and outputs as deviations
/// from `origin`.
///
/// One slope after the other, the term that entered last first, is rounded at its least-squares value given those
/// that are rounded already (Babai 1986, the nearest plane); then the intercept at its least-squares value given all
/// slopes. Each coefficient thus makes up for the rounding of those before it. A slope of a parent whose term has a
/// slope keeps one digit, so that no product stands without its main terms. `parents`: one entry a term of `sums`, or
/// empty. A slope that rounding gives the wrong sign becomes 0.
Equation rounded_equation(const LocalSums& sums, const SelectionPath& path, Eigen::Index count, const Origin& origin,
                          const Grains& grains, const std::vector<Parents>& parents = {});

}  // namespace llmt
