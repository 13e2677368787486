/// \file
/// Ridge regression with more coefficients than rows.
#pragma once

#include <Eigen/Core>

namespace llmt {

/// Solves (G + H) X = B where G = A' A is the Gram matrix of at most `rows` rows [1, x], H is diagonal, 0 at the
/// constant and positive elsewhere, and every column of B is a combination of rows of A.
///
/// Without the constant, S = G_xx - g g' / G_11 = L L' by a Cholesky factorisation with pivots, which ends after
/// r <= rows columns. With B_x - g B_1 / G_11 = L C, which the pivots' rows determine,
///   X_x = H^-1 L (I + L' H^-1 L)^-1 C,  X_1 = (B_1 - g' X_x) / G_11.
/// For k coefficients that takes some k r^2 operations, where a factorisation of G + H takes k^3 / 3.
Eigen::MatrixXd wide_ridge(const Eigen::MatrixXd& gram, const Eigen::VectorXd& diagonal, const Eigen::MatrixXd& right,
                           Eigen::Index rows);

}  // namespace llmt
