#include "numerics/node_fit.hpp"

#include <Eigen/QR>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "numerics/tolerances.hpp"
#include "numerics/whitening.hpp"

namespace llmt {
namespace {

// The Cholesky factor of the correlation matrix is used if the columns before each column leave at least this part of
// its variance. It has half the digits of a QR factorisation.
constexpr double least_independence = 1e-6;

// The columns of x that vary over the rows, and their means and sizes.
struct Columns {
  std::vector<Eigen::Index> varying;
  Eigen::VectorXd mean;
  Eigen::VectorXd low;
  Eigen::VectorXd high;
  Eigen::VectorXd largest;  // largest deviation from the mean, of each varying column
};

Columns describe(const RowMajor& x, const Eigen::VectorXd& weights) {
  const Eigen::Index count = x.cols();
  Columns columns;
  columns.low.setConstant(count, std::numeric_limits<double>::infinity());
  columns.high = -columns.low;
  Eigen::VectorXd present = Eigen::VectorXd::Zero(count);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double* row = x.data() + i * count;
    const double weight = weights(i);
    for (Eigen::Index j = 0; j < count; ++j) {
      const double value = row[j];
      const bool known = value == value;
      present(j) += known ? weight : 0.0;
      sum(j) += known ? weight * value : 0.0;
      columns.low(j) = value < columns.low(j) ? value : columns.low(j);
      columns.high(j) = value > columns.high(j) ? value : columns.high(j);
    }
  }
  columns.mean.setZero(count);
  columns.largest.resize(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    if (columns.low(j) < columns.high(j)) {
      columns.mean(j) = sum(j) / present(j);
      columns.largest(std::ssize(columns.varying)) =
          std::max(columns.high(j) - columns.mean(j), columns.mean(j) - columns.low(j));
      columns.varying.push_back(j);
    } else {  // constant over these rows, or all missing
      columns.mean(j) = columns.low(j) == columns.high(j) ? columns.low(j) : 0.0;
      columns.low(j) = columns.high(j) = columns.mean(j);
    }
  }
  return columns;
}

// Constant, deviations of the varying columns divided by the largest, and residuals about their mean.
Features scaled_features(const RowMajor& x, const Columns& columns, const Eigen::MatrixXd& residuals,
                         const Eigen::RowVectorXd& mean, const Eigen::VectorXd& weights) {
  const Eigen::Index kept = std::ssize(columns.varying);
  Features features(x.rows(), 1 + kept, residuals.cols());
  // Dividing by the largest deviation keeps the squares of very small and very large columns in range.
  const Eigen::VectorXd inverse = columns.largest.head(kept).cwiseInverse();
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double root = std::sqrt(weights(i));
    double* row = features.row(i);
    row[0] = root;
    for (Eigen::Index k = 0; k < kept; ++k) {
      const Eigen::Index j = columns.varying[k];
      const double deviation = (x(i, j) - columns.mean(j)) * inverse(k);
      row[1 + k] = deviation == deviation ? root * deviation : 0.0;
    }
    for (Eigen::Index o = 0; o < residuals.cols(); ++o) {
      row[1 + kept + o] = root * (residuals(i, o) - mean(o));
    }
  }
  return features;
}

// The matrix W with which the regressors z W are orthogonal with mean square 1, from the Gram matrix of scaled
// features. Empty if the regressors are too collinear for that.
Eigen::MatrixXd whitening_matrix(const GramShape& shape, const std::vector<double>& gram, double total) {
  const Eigen::Index count = shape.coefficients() - 1;
  Eigen::VectorXd scale(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    scale(k) = std::sqrt(gram[shape.at(k + 1, k + 1)] / total);
  }
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(count, count);  // lower triangle L of the correlation matrix L L'
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      double sum = i == j ? 1.0 : gram[shape.at(i + 1, j + 1)] / (total * scale(i) * scale(j));
      for (Eigen::Index k = 0; k < j; ++k) {
        sum -= factor(i, k) * factor(j, k);
      }
      if (i > j) {
        factor(i, j) = sum / factor(j, j);
      } else if (sum > least_independence) {
        factor(i, i) = std::sqrt(sum);
      } else {
        return {};
      }
    }
  }
  const Eigen::MatrixXd inverse =
      factor.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(count, count)).transpose();
  return scale.cwiseInverse().asDiagonal() * inverse;
}

// Orthogonalises the regressors by Householder QR with column pivoting; sets the rank. Returns the matrix that takes
// the products of residuals with them, divided by the total weight, to slopes of minimum norm in columns of unit
// variance.
Eigen::MatrixXd orthogonalise(Features& features, double total, int& rank) {
  const Eigen::Index rows = features.rows();
  const Eigen::Index count = features.coefficients() - 1;
  Eigen::MatrixXd x(rows, count);
  for (Eigen::Index i = 0; i < rows; ++i) {
    x.row(i) = Eigen::Map<const Eigen::RowVectorXd>(features.row(i) + 1, count);
  }
  const Eigen::VectorXd scale = (x.colwise().squaredNorm() / total).cwiseSqrt().transpose();
  x *= scale.cwiseInverse().asDiagonal();
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
  decomposition.setThreshold(collinearity_tolerance);
  decomposition.compute(x);
  rank = 1 + static_cast<int>(decomposition.rank());
  Eigen::MatrixXd basis = Eigen::MatrixXd::Identity(rows, decomposition.rank());
  basis.applyOnTheLeft(decomposition.householderQ());
  basis *= std::sqrt(total);
  Features reduced(rows, rank, features.outputs());
  for (Eigen::Index i = 0; i < rows; ++i) {
    reduced.row(i)[0] = features.row(i)[0];
    Eigen::Map<Eigen::RowVectorXd>(reduced.row(i) + 1, rank - 1) = basis.row(i);
    std::copy_n(features.row(i) + 1 + count, features.outputs(), reduced.row(i) + rank);
  }
  features = std::move(reduced);
  return scale.cwiseInverse().asDiagonal() * decomposition.solve(basis);
}

// Makes the regressors orthogonal with weighted mean square 1 and sets the rank of [1, regressors]. Returns the matrix
// that takes coefficients of the new regressors to slopes in the old ones.
Eigen::MatrixXd orthonormalise(Features& features, double total, int& rank) {
  const Eigen::Index count = features.coefficients() - 1;
  rank = 1;
  if (count == 0) return Eigen::MatrixXd(0, 0);
  const GramShape shape(features);
  std::vector<double> gram(shape.size(), 0.0);
  std::vector<int> all(features.rows());
  std::iota(all.begin(), all.end(), 0);
  add_rows(features, all.data(), features.rows(), gram.data());
  Eigen::MatrixXd to_slopes = whitening_matrix(shape, gram, total);
  if (to_slopes.size() == 0) return orthogonalise(features, total, rank);
  rank = 1 + static_cast<int>(count);
  const Eigen::Index width = (count + GramShape::lanes - 1) / GramShape::lanes * GramShape::lanes;
  std::vector<double> matrix(count * width, 0.0);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = i; j < count; ++j) {
      matrix[i * width + j] = to_slopes(i, j);
    }
  }
  transform_regressors(features, matrix);
  return to_slopes;
}

// Subtracts from the residuals of an output their projection on the orthonormal features. Returns its coefficients and
// sets the sum of squares of what is left.
Eigen::VectorXd subtract_projection(Features& features, Eigen::Index output, double total, double& rss) {
  std::vector<double> coefficients(features.coefficients(), 0.0);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(features.coefficients());
  // Three passes over the rows: the first finds the coefficients, the second subtracts them and finds what rounding
  // left of them, the third subtracts that. So the residuals are orthogonal to the regressors to rounding relative to
  // the residuals, not to the outputs.
  for (int pass = 0; pass < 2; ++pass) {
    const Remainder remainder = subtract_fit(features, output, coefficients);
    for (std::size_t k = 0; k < coefficients.size(); ++k) {
      coefficients[k] = remainder.products[k] / total;
      sum(k) += coefficients[k];
    }
  }
  rss = subtract_fit(features, output, coefficients).squares;
  return sum;
}

}  // namespace

Eigen::MatrixXd NodeFit::residuals() const {
  Eigen::MatrixXd result(features.rows(), features.outputs());
  for (Eigen::Index i = 0; i < features.rows(); ++i) {
    const double* row = features.row(i);
    for (Eigen::Index o = 0; o < features.outputs(); ++o) {
      result(i, o) = row[features.coefficients() + o] / row[0];
    }
  }
  return result;
}

NodeFit fit_node(const RowMajor& x, const Eigen::MatrixXd& residuals, const Eigen::VectorXd& weights) {
  const double total = weights.sum();
  const Columns columns = describe(x, weights);
  const Eigen::RowVectorXd mean = weights.transpose() * residuals / total;
  NodeFit fit;
  fit.mean = columns.mean;
  fit.low = columns.low;
  fit.high = columns.high;
  fit.centre_change = mean.transpose();
  fit.slope_change = Eigen::MatrixXd::Zero(residuals.cols(), x.cols());
  fit.rss.resize(residuals.cols());
  Features& features = fit.features;
  features = scaled_features(x, columns, residuals, mean, weights);

  const Eigen::MatrixXd to_slopes = orthonormalise(features, total, fit.rank);
  for (Eigen::Index o = 0; o < residuals.cols(); ++o) {
    const Eigen::VectorXd coefficients = subtract_projection(features, o, total, fit.rss(o));
    fit.centre_change(o) += coefficients(0);
    const Eigen::VectorXd slopes = to_slopes * coefficients.tail(fit.rank - 1);
    for (Eigen::Index k = 0; k < slopes.size(); ++k) {
      const Eigen::Index column = columns.varying[k];
      fit.slope_change(o, column) = slopes(k) / columns.largest(k);
      fit.centre_change(o) -= fit.slope_change(o, column) * fit.mean(column);
    }
  }
  return fit;
}

}  // namespace llmt
