#include "fit/choices/lack_of_fit.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "numerics/f_distribution.hpp"

namespace llmt {
namespace {

// An orthonormal basis of the columns, each of length 1 or 0, but for those of which less than 1e-6 is left.
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> decomposition;
  decomposition.setThreshold(1e-6);
  decomposition.compute(columns);
  return decomposition.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), decomposition.rank());
}

Eigen::VectorXd centred(const Eigen::Ref<const Eigen::VectorXd>& column) {
  const auto is_here = column.array().isNaN() == false;
  const double present = static_cast<double>(is_here.count());
  const double mean = is_here.select(column.array(), 0.0).sum() / std::max(1.0, present);
  Eigen::VectorXd result = is_here.select(column.array() - mean, 0.0);
  result.stableNormalize();
  return result;
}

}  // namespace

LackOfFit::LackOfFit(const Eigen::Ref<const Eigen::MatrixXd>& numbers,
                     const Eigen::Ref<const Eigen::MatrixXd>& outputs) {
  Eigen::MatrixXd columns(numbers.rows(), numbers.cols() + 1);
  columns.col(0).setConstant(1.0 / std::sqrt(static_cast<double>(numbers.rows())));
  for (Eigen::Index j = 0; j < numbers.cols(); ++j) columns.col(j + 1) = centred(numbers.col(j));
  basis_ = orthonormal(columns);
  residuals_.resize(outputs.rows(), outputs.cols());
  for (Eigen::Index o = 0; o < outputs.cols(); ++o) residuals_.col(o) = centred(outputs.col(o));
  residuals_ -= basis_ * (basis_.transpose() * residuals_);
}

double LackOfFit::p_value(const Eigen::Ref<const Eigen::VectorXd>& input, const std::vector<double>& values) const {
  Eigen::MatrixXd indicators(input.size(), std::ssize(values));
  for (std::size_t k = 0; k < values.size(); ++k) {
    auto column = indicators.col(static_cast<Eigen::Index>(k));
    column = (input.array() == values[k]).cast<double>();
    column.stableNormalize();
  }
  indicators -= basis_ * (basis_.transpose() * indicators);
  // Columns that say nothing new are left with rounding errors, which must not count.
  for (auto column : indicators.colwise()) {
    if (column.norm() < 1e-6) column.setZero();
  }
  const Eigen::MatrixXd added = orthonormal(indicators);
  const auto freedom = static_cast<double>(input.size() - basis_.cols() - added.cols());
  if (added.cols() == 0 || freedom < 1.0) return 1.0;
  double least = 1.0;
  for (const auto residual : residuals_.colwise()) {
    const double explained = (added.transpose() * residual).squaredNorm();
    const double rest = std::max(residual.squaredNorm() - explained, 1e-14);
    least = std::min(least, chow_p_value(explained, static_cast<double>(added.cols()), rest / freedom, freedom));
  }
  return std::min(1.0, least * static_cast<double>(residuals_.cols()));
}

}  // namespace llmt
