#include "numerics/wide_ridge.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace llmt {
namespace {

// Pivots below this share of the largest are rounding.
constexpr double least_pivot = 1e-14;

struct LowRank {
  Eigen::MatrixXd factor;            // L, k x r
  std::vector<Eigen::Index> pivots;  // the rows of L that are a lower triangle
};

// L L' of the Gram matrix of columns without their means.
LowRank factored(const Eigen::MatrixXd& gram, Eigen::Index rows) {
  const Eigen::Index size = gram.rows() - 1;
  const auto slopes = Eigen::seqN(1, size);
  const Eigen::VectorXd of_constant = gram(slopes, 0);
  const double total = gram(0, 0);
  Eigen::VectorXd left = gram.diagonal()(slopes) - of_constant.cwiseAbs2() / total;
  LowRank result{Eigen::MatrixXd(size, std::min(rows, size)), {}};
  const double smallest = least_pivot * left.maxCoeff();
  for (Eigen::Index r = 0; r < result.factor.cols(); ++r) {
    Eigen::Index pivot = 0;
    if (!(left.maxCoeff(&pivot) > smallest)) break;
    const auto done = result.factor.leftCols(r);
    Eigen::VectorXd column = gram(slopes, pivot + 1) - of_constant * (of_constant(pivot) / total);
    column -= done * done.row(pivot).transpose();
    column /= std::sqrt(left(pivot));
    for (const Eigen::Index before : result.pivots) column(before) = 0.0;
    left -= column.cwiseAbs2();
    left(pivot) = 0.0;
    result.factor.col(r) = column;
    result.pivots.push_back(pivot);
  }
  result.factor.conservativeResize(Eigen::NoChange, std::ssize(result.pivots));
  return result;
}

}  // namespace

Eigen::MatrixXd wide_ridge(const Eigen::MatrixXd& gram, const Eigen::VectorXd& diagonal, const Eigen::MatrixXd& right,
                           Eigen::Index rows) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(right.rows(), right.cols());
  const double total = gram(0, 0);
  if (!(total > 0.0)) return result;
  const auto slopes = Eigen::seqN(1, gram.rows() - 1);
  const auto [factor, pivots] = factored(gram, rows);
  if (!pivots.empty()) {
    const Eigen::MatrixXd centred = right(slopes, Eigen::all) - gram(slopes, 0) * (right.row(0) / total);
    const Eigen::MatrixXd triangle = factor(pivots, Eigen::all);
    const Eigen::MatrixXd target = triangle.triangularView<Eigen::Lower>().solve(centred(pivots, Eigen::all));
    const Eigen::MatrixXd scaled = diagonal(slopes).cwiseInverse().asDiagonal() * factor;
    Eigen::MatrixXd inner = factor.transpose() * scaled;
    inner.diagonal().array() += 1.0;
    result(slopes, Eigen::all) = scaled * inner.llt().solve(target);
  }
  result.row(0) = (right.row(0) - gram(0, slopes) * result(slopes, Eigen::all)) / total;
  return result;
}

}  // namespace llmt
