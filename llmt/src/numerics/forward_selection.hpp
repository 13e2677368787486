/// \file
/// Which regressors a local model needs.
#pragma once

#include <Eigen/Core>
#include <array>
#include <tuple>
#include <vector>

namespace llmt {

/// Weighted sums over the rows of a local model, a = [1, x] its regressors.
struct LocalSums {
  Eigen::MatrixXd gram;      ///< sum of q a a'
  Eigen::MatrixXd products;  ///< sum of q a y, coefficients x outputs
  Eigen::VectorXd squares;   ///< sum of q y^2, one per output

  static auto fields(auto& self) { return std::tie(self.gram, self.products, self.squares); }
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

/// The models on the way of that forward selection.
struct SelectionPath {
  std::vector<Eigen::Index> regressors;  ///< in the order in which they enter, counted from 0 without the constant
  Eigen::MatrixXd
      rss;  ///< residual sums of squares with the constant and the first 0, 1, 2, ... of them, one row an output
};

/// The regressors that must be in a model before this one, such as the factors of a product; -1: none.
using Parents = std::array<Eigen::Index, 2>;

/// At most `most` regressors; fewer where the others say nothing new or the residuals are rounding. With `parents`, one
/// entry a regressor, the parents of the best regressor enter before it; it never does if one of them cannot.
SelectionPath selection_path(const LocalSums& sums, Eigen::Index most, const std::vector<Parents>& parents = {});

}  // namespace llmt
