#include "node_fit.hpp"

#include <Eigen/QR>
#include <cmath>
#include <limits>
#include <vector>

namespace llmt {
namespace {

/// Columns of `x` that vary, centred and scaled to weighted mean square 1, times the roots of the weights.
struct ScaledColumns {
  Eigen::MatrixXd values;  // rows x varying columns
  std::vector<std::ptrdiff_t> column;
  Eigen::VectorXd mean;      // of all columns
  Eigen::RowVectorXd scale;  // of the varying columns
};

ScaledColumns scale_columns(const Eigen::MatrixXd& x, const Eigen::VectorXd& weights,
                            const Eigen::VectorXd& root_weights) {
  ScaledColumns scaled;
  const double total = weights.sum();
  scaled.values.resize(x.rows(), x.cols());
  scaled.mean = Eigen::VectorXd::Zero(x.cols());
  scaled.scale.resize(x.cols());
  std::ptrdiff_t kept = 0;
  for (std::ptrdiff_t j = 0; j < x.cols(); ++j) {
    double present = 0.0;
    double sum = 0.0;
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    bool missing = false;
    for (std::ptrdiff_t i = 0; i < x.rows(); ++i) {
      if (std::isnan(x(i, j))) {
        missing = true;
        continue;
      }
      present += weights(i);
      sum += weights(i) * x(i, j);
      low = std::min(low, x(i, j));
      high = std::max(high, x(i, j));
    }
    if (!(low < high)) {
      scaled.mean(j) = low == high ? low : 0.0;  // constant over these rows, or all missing
      continue;
    }
    const double mean = sum / present;
    scaled.mean(j) = mean;
    Eigen::VectorXd deviation = x.col(j).array() - mean;
    if (missing) {
      deviation = deviation.array().isNaN().select(0.0, deviation);
    }
    // Dividing by the largest deviation first keeps the squares of very small and very large columns in range.
    const double largest = deviation.cwiseAbs().maxCoeff();
    deviation = (deviation / largest).cwiseProduct(root_weights);
    const double root_mean_square = std::sqrt(deviation.squaredNorm() / total);
    scaled.values.col(kept) = deviation / root_mean_square;
    scaled.scale(kept) = largest * root_mean_square;
    scaled.column.push_back(j);
    ++kept;
  }
  scaled.values.conservativeResize(Eigen::NoChange, kept);
  return scaled;
}

}  // namespace

NodeFit fit_node(const Eigen::MatrixXd& x, const Eigen::MatrixXd& residuals, const Eigen::VectorXd& weights) {
  const double total = weights.sum();
  NodeFit fit;
  fit.root_weights = weights.cwiseSqrt();
  ScaledColumns scaled = scale_columns(x, weights, fit.root_weights);
  fit.mean = std::move(scaled.mean);

  const Eigen::RowVectorXd mean = weights.transpose() * residuals / total;
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
    fit.basis *= std::sqrt(total);

    Eigen::MatrixXd weighted = fit.root_weights.asDiagonal() * fit.residuals;
    const Eigen::MatrixXd scaled_slopes = decomposition.solve(weighted);  // varying columns x outputs
    for (std::size_t k = 0; k < scaled.column.size(); ++k) {
      const std::ptrdiff_t kept = static_cast<std::ptrdiff_t>(k);
      fit.slope_change.col(scaled.column[k]) = scaled_slopes.row(kept).transpose() / scaled.scale(kept);
      fit.centre_change -= fit.slope_change.col(scaled.column[k]) * fit.mean(scaled.column[k]);
    }
    // Twice: the second pass removes what rounding left of the first, so that the residuals are orthogonal to the basis
    // to rounding relative to themselves, not relative to the outputs.
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::MatrixXd projection = fit.basis.transpose() * weighted / total;
      weighted -= fit.basis * projection;
      const Eigen::RowVectorXd left = fit.root_weights.transpose() * weighted / total;
      weighted -= fit.root_weights * left;
    }
    fit.residuals = fit.root_weights.cwiseInverse().asDiagonal() * weighted;
  } else {
    fit.basis.resize(x.rows(), 0);
  }
  fit.rss = (fit.root_weights.asDiagonal() * fit.residuals).colwise().squaredNorm().transpose();
  return fit;
}

}  // namespace llmt
