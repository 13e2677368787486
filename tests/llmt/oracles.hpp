// Slow, obvious versions of what the library computes, and data to compare on.
#pragma once

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "llmt/random.hpp"

namespace oracle {

using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

/// Residual sum of squares of least squares of y on [1, x], rank-revealing, in long double.
inline long double rss(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  Matrix regressors(x.rows(), x.cols() + 1);
  regressors.col(0).setOnes();
  for (std::ptrdiff_t j = 0; j < x.cols(); ++j) {
    const Eigen::Matrix<long double, Eigen::Dynamic, 1> column = x.col(j).cast<long double>();
    const Eigen::Matrix<long double, Eigen::Dynamic, 1> centred = column.array() - column.mean();
    const long double norm = centred.norm();
    regressors.col(j + 1) = norm > 0 ? Matrix(centred / norm) : Matrix(centred);
  }
  Eigen::CompleteOrthogonalDecomposition<Matrix> decomposition;
  decomposition.setThreshold(1e-10L);
  decomposition.compute(regressors);
  const Matrix target = y.cast<long double>();
  return (target - regressors * decomposition.solve(target)).squaredNorm();
}

struct Split {
  int input = -1;
  double low = 0.0;  // the gap
  double high = 0.0;
  long double rss = std::numeric_limits<long double>::infinity();
};

/// Refits both children of every admissible split.
inline Split best_split(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, std::ptrdiff_t min_leaf,
                        long double tie_tolerance) {
  const long double tolerance = tie_tolerance * rss(x, y);
  Split best;
  for (int j = 0; j < x.cols(); ++j) {
    std::vector<double> values(x.col(j).begin(), x.col(j).end());
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    for (std::size_t k = 0; k + 1 < values.size(); ++k) {
      std::vector<int> left;
      std::vector<int> right;
      for (int row = 0; row < x.rows(); ++row) {
        (x(row, j) <= values[k] ? left : right).push_back(row);
      }
      if (std::ssize(left) < min_leaf || std::ssize(right) < min_leaf) {
        continue;
      }
      const long double total =
          rss(x(left, Eigen::all), y(left, Eigen::all)) + rss(x(right, Eigen::all), y(right, Eigen::all));
      if (total < best.rss - tolerance) {
        best = {j, values[k], values[k + 1], total};
      }
    }
  }
  return best;
}

inline Eigen::MatrixXd uniform(std::ptrdiff_t rows, std::ptrdiff_t columns, std::uint64_t seed) {
  llmt::Random random(seed);
  Eigen::MatrixXd values(rows, columns);
  for (double& value : values.reshaped()) {
    value = random.uniform(-1.0, 1.0);
  }
  return values;
}

/// Values on a grid of 2^-20: adding 1e6 to inputs or 1e8 to outputs, or scaling by powers of two, rounds nothing.
inline Eigen::MatrixXd coarse(const Eigen::MatrixXd& values) {
  return (values * 0x1p20).array().round().matrix() * 0x1p-20;
}

/// A curved, kinked target of the first two columns.
inline Eigen::MatrixXd curved(const Eigen::MatrixXd& x, double noise = 0.0, std::uint64_t seed = 7) {
  llmt::Random random(seed);
  Eigen::MatrixXd y(x.rows(), 1);
  for (std::ptrdiff_t i = 0; i < x.rows(); ++i) {
    y(i, 0) = std::sin(3.0 * x(i, 0)) + std::abs(x(i, 1) - 0.2) + 0.3 * x(i, x.cols() - 1) + noise * random.normal();
  }
  return y;
}

}  // namespace oracle
