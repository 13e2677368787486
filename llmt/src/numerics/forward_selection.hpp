/// \file
/// Which regressors a local model needs.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt {

/// Weighted sums over the rows of a local model, a = [1, x] its regressors.
struct LocalSums {
  Eigen::MatrixXd gram;      ///< sum of q a a'
  Eigen::MatrixXd products;  ///< sum of q a y, coefficients x outputs
  Eigen::VectorXd squares;   ///< sum of q y^2, one per output
};

/// Forward selection by orthogonal least squares (Chen, Billings & Luo 1989): the next regressor is the one whose part
/// that is orthogonal to those before lowers the residual sum of squares most. Several outputs share one choice: the
/// sum of squares of each is divided by that about its mean.
///
/// Of the models on the way the one with the smallest AICc (Hurvich & Tsai 1989) is taken, eq. (E.5) of
/// docs/algorithms/estimation.md,
///   sum over outputs of [N ln(RSS / N) + 2 k + 2 k (k + 1) / (N - k - 1)],  k = coefficients + 1,
/// N = `rows_per_weight` times the weight. The search ends when 10 further regressors have not lowered AICc, or when
/// the residuals are rounding. Returns the positions of the chosen coefficients, ascending, the constant's first.
std::vector<Eigen::Index> select_regressors(const LocalSums& sums, double rows_per_weight);

}  // namespace llmt
