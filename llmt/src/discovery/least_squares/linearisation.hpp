// The scaled linear problem of one iteration, and what its singular values say.
#pragma once

#include <vector>

#include "llmt/discovery/problem.hpp"

namespace llmt::discovery {

/// min |A x + b| with A = weighted Jacobian, columns times scale, prior rows appended, reduced by QR and SVD.
struct Linearisation {
  Eigen::VectorXd singular_values;  // k, falling
  Eigen::MatrixXd directions;       // k x k, right singular vectors
  Eigen::VectorXd projected;        // k, left singular vectors' shares of b
  Eigen::Index rank = 0;

  /// Norm of the part of b that a full step removes to first order.
  double removable_norm() const { return projected.head(rank).norm(); }

  /// Minimum-norm step in scaled parameters; damping is relative to the largest singular value squared.
  Eigen::VectorXd step(double damping) const;
};

/// `matrix` is n x k, `rhs` has n entries; both are consumed.
Linearisation linearise(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& rhs, double rank_tolerance);

/// Singular values of an n x k matrix through its QR factorisation, falling.
Eigen::VectorXd singular_values_of(const Eigen::MatrixXd& matrix);

/// The null directions made sparse by Gauss-Jordan elimination with full pivoting; `names` and `scales` belong to the k
/// columns.
std::vector<Combination> null_combinations(const Linearisation& linear, const std::vector<std::string>& names,
                                           const Eigen::VectorXd& scales);

/// Entries of a unit null vector below this are rounding, above it the parameter takes part.
inline constexpr double null_entry_tolerance = 1e-5;

}  // namespace llmt::discovery
