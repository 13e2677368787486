#include "linear_algebra/linear_algebra.hpp"

#include <algorithm>
#include <cmath>

namespace llmt::robotics {
namespace {

constexpr double dependent = 1e-9;  // of the length of a column

Eigen::ColPivHouseholderQR<Eigen::MatrixXd> ordered_by_pivots(const Eigen::MatrixXd& columns) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(columns);
  factors.setThreshold(dependent);
  return factors;
}

}  // namespace

Eigen::MatrixXd rows_of(const Eigen::MatrixXd& matrix, const std::vector<Eigen::Index>& rows) {
  return matrix(rows, Eigen::all);
}

Eigen::MatrixXd columns_of(const Eigen::MatrixXd& matrix, const std::vector<Eigen::Index>& columns) {
  return matrix(Eigen::all, columns);
}

Eigen::VectorXd entries_of(const Eigen::VectorXd& vector, const std::vector<Eigen::Index>& entries) {
  return vector(entries);
}

Eigen::MatrixXd side_by_side(const Eigen::MatrixXd& left, const Eigen::MatrixXd& right) {
  Eigen::MatrixXd both(left.rows(), left.cols() + right.cols());
  both << left, right;
  return both;
}

Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a * b; }

Eigen::VectorXd product(const Eigen::MatrixXd& a, const Eigen::VectorXd& x) { return a * x; }

void subtract_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, Eigen::MatrixXd& from) {
  from.noalias() -= a * b;
}

Eigen::MatrixXd transposed_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a.transpose() * b; }

Eigen::VectorXd transposed_product(const Eigen::MatrixXd& a, const Eigen::VectorXd& x) { return a.transpose() * x; }

Eigen::MatrixXd gram(const Eigen::MatrixXd& a) { return a.transpose() * a; }

Eigen::MatrixXd weighted_gram(const Eigen::MatrixXd& a, const Eigen::VectorXd& weights) {
  return a.transpose() * weights.asDiagonal() * a;
}

Eigen::MatrixXd identity_minus_gram(const Eigen::MatrixXd& a) {
  return Eigen::MatrixXd::Identity(a.cols(), a.cols()) - a.transpose() * a;
}

Eigen::VectorXd quadratic_forms(const Eigen::MatrixXd& a, const Eigen::MatrixXd& m) {
  return (a * m).cwiseProduct(a).rowwise().sum();
}

Eigen::VectorXd column_norms(const Eigen::MatrixXd& matrix) { return matrix.colwise().norm().transpose(); }

Eigen::VectorXd row_norms(const Eigen::MatrixXd& matrix) { return matrix.rowwise().norm(); }

void normalize_columns(Eigen::MatrixXd& matrix) {
  for (auto column : matrix.colwise()) column.normalize();
}

void scale_rows(Eigen::MatrixXd& matrix, const Eigen::VectorXd& factors) {
  matrix.array().colwise() *= factors.array();
}

void scale_columns(Eigen::MatrixXd& matrix, const Eigen::VectorXd& factors) { matrix *= factors.asDiagonal(); }

Eigen::MatrixXd orthonormal_range(const Eigen::MatrixXd& columns) {
  const auto factors = ordered_by_pivots(columns);
  Eigen::MatrixXd basis = Eigen::MatrixXd::Identity(columns.rows(), factors.rank());
  basis.applyOnTheLeft(factors.householderQ());
  return basis;
}

std::vector<Eigen::Index> independent_columns(const Eigen::MatrixXd& columns) {
  const auto factors = ordered_by_pivots(columns);
  const auto& order = factors.colsPermutation().indices();
  std::vector<Eigen::Index> chosen(order.begin(), order.begin() + factors.rank());
  std::ranges::sort(chosen);
  return chosen;
}

void remove_range(const Eigen::MatrixXd& basis, Eigen::VectorXd& vector) {
  vector -= basis * (basis.transpose() * vector);
}

void remove_range(const Eigen::MatrixXd& basis, Eigen::MatrixXd& matrix) {
  subtract_product(basis, transposed_product(basis, matrix), matrix);
}

Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& s, const Eigen::VectorXd& b) { return s.ldlt().solve(b); }

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& matrix) {
  return matrix.completeOrthogonalDecomposition().pseudoInverse();
}

Cholesky::Cholesky(const Eigen::MatrixXd& matrix) : factor_(matrix) {}

Eigen::MatrixXd Cholesky::lower() const { return factor_.matrixL(); }

double Cholesky::log_determinant() const { return 2.0 * factor_.matrixLLT().diagonal().array().log().sum(); }

Eigen::VectorXd Cholesky::solve(const Eigen::VectorXd& right) const { return factor_.solve(right); }

Eigen::MatrixXd Cholesky::solve(const Eigen::MatrixXd& right) const { return factor_.solve(right); }

Eigen::MatrixXd Cholesky::whitened(const Eigen::MatrixXd& rows) const {
  return factor_.matrixL().solve(rows.transpose());
}

RangeRotation::RangeRotation(const Eigen::MatrixXd& a) : factors_(a) {}

Eigen::VectorXd RangeRotation::operator()(const Eigen::VectorXd& vector) const {
  return factors_.householderQ().transpose() * vector;
}

Eigen::MatrixXd RangeRotation::operator()(const Eigen::MatrixXd& matrix) const {
  return factors_.householderQ().transpose() * matrix;
}

}  // namespace llmt::robotics
