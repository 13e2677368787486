/// \file
/// Linear algebra of plain matrices and vectors, compiled once.
///
/// Every source that uses an expression of Eigen's compiles its templates again, a product or a decomposition for half
/// a second. These functions evaluate the same expressions, so that a call and the expression give the same bytes.
/// Loops in which a program spends its time keep the expressions.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <vector>

namespace llmt::robotics {

/// Rows, columns or entries by their numbers, in the order given.
Eigen::MatrixXd rows_of(const Eigen::MatrixXd& matrix, const std::vector<Eigen::Index>& rows);
Eigen::MatrixXd columns_of(const Eigen::MatrixXd& matrix, const std::vector<Eigen::Index>& columns);
Eigen::VectorXd entries_of(const Eigen::VectorXd& vector, const std::vector<Eigen::Index>& entries);

/// [left right], of equally many rows.
Eigen::MatrixXd side_by_side(const Eigen::MatrixXd& left, const Eigen::MatrixXd& right);

/// A B and A x.
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::VectorXd product(const Eigen::MatrixXd& a, const Eigen::VectorXd& x);

/// C - A B, in place.
void subtract_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, Eigen::MatrixXd& from);

/// A' B and A' x.
Eigen::MatrixXd transposed_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::VectorXd transposed_product(const Eigen::MatrixXd& a, const Eigen::VectorXd& x);

/// A' A, A' diag(w) A, and 1 - A' A.
Eigen::MatrixXd gram(const Eigen::MatrixXd& a);
Eigen::MatrixXd weighted_gram(const Eigen::MatrixXd& a, const Eigen::VectorXd& weights);
Eigen::MatrixXd identity_minus_gram(const Eigen::MatrixXd& a);

/// a_i' M a_i for every row a_i of A.
Eigen::VectorXd quadratic_forms(const Eigen::MatrixXd& a, const Eigen::MatrixXd& m);

/// Euclidean norms of all columns or rows.
Eigen::VectorXd column_norms(const Eigen::MatrixXd& matrix);
Eigen::VectorXd row_norms(const Eigen::MatrixXd& matrix);

/// Every column gets length 1. A column of zeros stays.
void normalize_columns(Eigen::MatrixXd& matrix);

/// diag(factors) A and A diag(factors), in place.
void scale_rows(Eigen::MatrixXd& matrix, const Eigen::VectorXd& factors);
void scale_columns(Eigen::MatrixXd& matrix, const Eigen::VectorXd& factors);

/// Orthonormal columns that span the columns given. Those have length 1 or 0; one of which 1e-9 or less is independent
/// of the others counts as dependent.
Eigen::MatrixXd orthonormal_range(const Eigen::MatrixXd& columns);

/// Numbers of columns, ascending, that span the same. Lengths and tolerance as above.
std::vector<Eigen::Index> independent_columns(const Eigen::MatrixXd& columns);

/// Subtracts the projection on the range of orthonormal columns Q: x - Q Q' x, and so for every column of a matrix.
void remove_range(const Eigen::MatrixXd& basis, Eigen::VectorXd& vector);
void remove_range(const Eigen::MatrixXd& basis, Eigen::MatrixXd& matrix);

/// The x that minimises |A x - b|. Columns that depend on others get 0.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// S^-1 b of a symmetric S that is positive or negative semidefinite.
Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& s, const Eigen::VectorXd& b);

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& matrix);

/// S = L L' of a symmetric positive definite matrix, of which the lower triangle is read.
class Cholesky {
 public:
  explicit Cholesky(const Eigen::MatrixXd& matrix);

  /// False if the matrix is not positive definite. The other functions then have no meaning.
  bool exists() const { return factor_.info() == Eigen::Success; }

  Eigen::MatrixXd lower() const;
  double log_determinant() const;  ///< ln det S

  /// S^-1 x, and so for every column of a matrix.
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;

  /// L^-1 A'
  Eigen::MatrixXd whitened(const Eigen::MatrixXd& rows) const;

 private:
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

/// Q' of a QR decomposition of A, which is at least as high as wide: turns the range of A into the first axes.
class RangeRotation {
 public:
  RangeRotation() = default;
  explicit RangeRotation(const Eigen::MatrixXd& a);

  /// Q' x, and so for every column of a matrix.
  Eigen::VectorXd operator()(const Eigen::VectorXd& vector) const;
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& matrix) const;

 private:
  Eigen::HouseholderQR<Eigen::MatrixXd> factors_;
};

}  // namespace llmt::robotics
