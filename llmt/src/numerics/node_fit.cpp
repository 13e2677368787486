#include "numerics/node_fit.hpp"

#include <Eigen/QR>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "numerics/whitening.hpp"

namespace llmt {
namespace {

// Smallest share of a column's variance that the columns before it may leave for a Cholesky factor to be good enough:
// its digits are squared.
constexpr double least_independence = 1e-6;

// Columns of x that vary over the rows, and what makes them deviations of size one.
struct Columns {
  std::vector<Eigen::Index> varying;
  Eigen::VectorXd mean;
  Eigen::VectorXd low;
  Eigen::VectorXd high;
  Eigen::VectorXd largest;  // deviation from the mean, of the varying columns
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

// W such that the regressors times W are orthogonal with mean square 1, from the Gram matrix of scaled features; empty
// if they are too collinear for that.
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
  decomposition.setThreshold(rank_tolerance);
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

  const Eigen::Index kept = std::ssize(columns.varying);
  Eigen::MatrixXd to_slopes(kept, 0);  // from coefficients of the orthogonal regressors to those of the scaled columns
  if (kept > 0) {
    const GramShape shape(features);
    std::vector<double> gram(shape.size(), 0.0);
    std::vector<int> all(x.rows());
    std::iota(all.begin(), all.end(), 0);
    add_rows(features, all.data(), x.rows(), gram.data());
    to_slopes = whitening_matrix(shape, gram, total);
    if (to_slopes.size() > 0) {
      fit.rank = 1 + static_cast<int>(kept);
      const Eigen::Index width = (kept + GramShape::lanes - 1) / GramShape::lanes * GramShape::lanes;
      std::vector<double> matrix(kept * width, 0.0);
      for (Eigen::Index i = 0; i < kept; ++i) {
        for (Eigen::Index j = i; j < kept; ++j) {
          matrix[i * width + j] = to_slopes(i, j);
        }
      }
      transform_regressors(features, matrix);
    } else {
      to_slopes = orthogonalise(features, total, fit.rank);
    }
  }
  for (Eigen::Index o = 0; o < residuals.cols(); ++o) {
    std::vector<double> coefficients(fit.rank, 0.0);
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(fit.rank);
    // The first pass only finds the coefficients. Of the two that subtract, the second removes what rounding left of
    // the first, so that the residuals are orthogonal to the regressors to rounding relative to themselves, not to the
    // outputs.
    Remainder remainder;
    for (int pass = 0; pass < 3; ++pass) {
      remainder = subtract_fit(features, o, coefficients);
      if (pass < 2) {
        for (std::size_t k = 0; k < coefficients.size(); ++k) {
          coefficients[k] = remainder.products[k] / total;
          sum(k) += coefficients[k];
        }
      }
    }
    fit.rss(o) = remainder.squares;
    fit.centre_change(o) += sum(0);
    const Eigen::VectorXd slopes = to_slopes * sum.tail(fit.rank - 1);
    for (Eigen::Index k = 0; k < kept; ++k) {
      const Eigen::Index column = columns.varying[k];
      fit.slope_change(o, column) = slopes(k) / columns.largest(k);
      fit.centre_change(o) -= fit.slope_change(o, column) * fit.mean(column);
    }
  }
  return fit;
}

}  // namespace llmt
