#include "discovery/least_squares/linearisation.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace llmt::discovery {
namespace {

// Upper triangle of the QR factorisation; matrices with fewer rows than columns are padded with zero rows.
Eigen::MatrixXd triangle_of(Eigen::MatrixXd matrix) {
  const Eigen::Index columns = matrix.cols();
  if (matrix.rows() < columns) {
    const Eigen::Index rows = matrix.rows();
    matrix.conservativeResize(columns, Eigen::NoChange);
    matrix.bottomRows(columns - rows).setZero();
  }
  const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(matrix);
  Eigen::MatrixXd triangle = Eigen::MatrixXd::Zero(columns, columns);
  triangle.triangularView<Eigen::Upper>() = qr.matrixQR().topRows(columns);
  return triangle;
}

Eigen::Index rank_of(const Eigen::VectorXd& singular_values, double tolerance) {
  if (singular_values.size() == 0 || singular_values(0) <= 0.0) return 0;
  return (singular_values.array() > tolerance * singular_values(0)).count();
}

}  // namespace

Eigen::VectorXd Linearisation::step(double damping) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(directions.rows());
  if (rank == 0) return result;
  const Eigen::ArrayXd s = singular_values.head(rank).array();
  const Eigen::VectorXd shares = -(s / (s.square() + damping * s(0) * s(0))) * projected.head(rank).array();
  result = directions.leftCols(rank) * shares;
  return result;
}

Linearisation linearise(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& rhs, double rank_tolerance) {
  const Eigen::Index k = matrix.cols();
  Eigen::MatrixXd augmented(matrix.rows(), k + 1);
  augmented << matrix, rhs;
  // The triangle of [A b] holds R and Q'b: nothing of the size n x n is ever formed.
  const Eigen::MatrixXd triangle = triangle_of(std::move(augmented));
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(triangle.topLeftCorner(k, k), Eigen::ComputeFullU | Eigen::ComputeFullV);
  Linearisation linear;
  linear.singular_values = svd.singularValues();
  linear.directions = svd.matrixV();
  linear.projected = svd.matrixU().transpose() * triangle.topRightCorner(k, 1);
  linear.rank = rank_of(linear.singular_values, rank_tolerance);
  return linear;
}

Eigen::VectorXd singular_values_of(const Eigen::MatrixXd& matrix) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(triangle_of(matrix));
  return svd.singularValues();
}

std::vector<Combination> null_combinations(const Linearisation& linear, const std::vector<std::string>& names,
                                           const Eigen::VectorXd& scales) {
  const Eigen::Index k = linear.directions.rows();
  const Eigen::Index count = k - linear.rank;
  Eigen::MatrixXd rows = linear.directions.rightCols(count).transpose();
  for (Eigen::Index i = 0; i < count; ++i) {
    Eigen::Index row = 0;
    Eigen::Index pivot = 0;
    rows.bottomRows(count - i).cwiseAbs().maxCoeff(&row, &pivot);
    rows.row(i).swap(rows.row(i + row));
    rows.row(i) /= Eigen::RowVectorXd(rows.row(i))(pivot);
    for (Eigen::Index other = 0; other < count; ++other) {
      if (other == i) continue;
      const double factor = rows(other, pivot);
      rows.row(other) -= factor * rows.row(i);
    }
  }
  std::vector<Combination> combinations(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double largest = rows.row(i).cwiseAbs().maxCoeff();
    for (Eigen::Index j = 0; j < k; ++j) {
      const double entry = rows(i, j) / largest;
      if (std::abs(entry) < null_entry_tolerance) continue;
      combinations[i].terms.push_back({names[j], entry * scales(j)});
    }
  }
  return combinations;
}

}  // namespace llmt::discovery
