#include "node_fit.hpp"

#include <Eigen/QR>
#include <cmath>
#include <vector>

namespace llmt {
namespace {

/// Columns of `x` that vary, centred and scaled to mean square 1.
struct ScaledColumns {
  Eigen::MatrixXd values;  // rows x varying columns
  std::vector<std::ptrdiff_t> column;
  Eigen::RowVectorXd mean;   // of the varying columns
  Eigen::RowVectorXd scale;  // of the varying columns
};

ScaledColumns scale_columns(const Eigen::MatrixXd& x) {
  ScaledColumns scaled;
  const double rows = static_cast<double>(x.rows());
  scaled.values.resize(x.rows(), x.cols());
  scaled.mean.resize(x.cols());
  scaled.scale.resize(x.cols());
  std::ptrdiff_t kept = 0;
  for (std::ptrdiff_t j = 0; j < x.cols(); ++j) {
    if (x.col(j).maxCoeff() == x.col(j).minCoeff()) {
      continue;  // constant over these rows
    }
    const double mean = x.col(j).sum() / rows;
    Eigen::VectorXd deviation = x.col(j).array() - mean;
    // Dividing by the largest deviation first keeps the squares of very small and very large columns in range.
    const double largest = deviation.cwiseAbs().maxCoeff();
    deviation /= largest;
    const double root_mean_square = std::sqrt(deviation.squaredNorm() / rows);
    scaled.values.col(kept) = deviation / root_mean_square;
    scaled.mean(kept) = mean;
    scaled.scale(kept) = largest * root_mean_square;
    scaled.column.push_back(j);
    ++kept;
  }
  scaled.values.conservativeResize(Eigen::NoChange, kept);
  return scaled;
}

}  // namespace

NodeFit fit_node(const Eigen::MatrixXd& x, const Eigen::MatrixXd& residuals) {
  const double rows = static_cast<double>(x.rows());
  const ScaledColumns scaled = scale_columns(x);

  NodeFit fit;
  const Eigen::RowVectorXd mean = residuals.colwise().sum() / rows;
  fit.residuals = residuals.rowwise() - mean;
  fit.centre_change = mean.transpose();
  fit.slope_change = Eigen::MatrixXd::Zero(residuals.cols(), x.cols());

  if (!scaled.column.empty()) {
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
    decomposition.setThreshold(rank_tolerance);
    decomposition.compute(scaled.values);
    const std::ptrdiff_t rank = decomposition.rank();
    fit.rank = 1 + static_cast<int>(rank);
    fit.basis = Eigen::MatrixXd::Identity(x.rows(), rank);
    fit.basis.applyOnTheLeft(decomposition.householderQ());
    fit.basis *= std::sqrt(rows);

    const Eigen::MatrixXd scaled_slopes = decomposition.solve(fit.residuals);  // varying columns x outputs
    for (std::size_t k = 0; k < scaled.column.size(); ++k) {
      const std::ptrdiff_t kept = static_cast<std::ptrdiff_t>(k);
      fit.slope_change.col(scaled.column[k]) = scaled_slopes.row(kept).transpose() / scaled.scale(kept);
      fit.centre_change -= fit.slope_change.col(scaled.column[k]) * scaled.mean(kept);
    }
    // Twice: the second pass removes what rounding left of the first, so that the residuals are orthogonal to the basis
    // to rounding relative to themselves, not relative to the outputs.
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::MatrixXd projection = fit.basis.transpose() * fit.residuals / rows;
      fit.residuals -= fit.basis * projection;
      fit.residuals.rowwise() -= Eigen::RowVectorXd(fit.residuals.colwise().sum() / rows);
    }
  } else {
    fit.basis.resize(x.rows(), 0);
  }
  fit.rss = fit.residuals.colwise().squaredNorm().transpose();
  return fit;
}

}  // namespace llmt
