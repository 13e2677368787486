// Slow, obvious versions of what the library computes, and data to compare on.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "llmt/random.hpp"

namespace oracle {

/// Residual sum of squares of least squares of y on [1, x], rank-revealing, in long double.
long double rss(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y);

/// Rank of [1, x].
int rank(const Eigen::MatrixXd& x);

/// A node whose splits are compared: number of rows (sum of the weights), rank and residual sum of squares of one
/// model.
struct WholeNode {
  double rows;
  int rank;
  long double rss;
};

/// One child of a split.
struct Side {
  Eigen::Index rows;
  int rank;
};

/// Residual sum of squares of a split as it is compared: by what it leaves per degree of freedom, in units in which a
/// split whose children have the rank of the node has its RSS. Children with fewer rows than twice the rank count as
/// such.
long double adjusted_rss(const WholeNode& node, long double rss, const Side& left, const Side& right);

/// Whether a side's model has a direction that only its two rows next to the split decide. `without`: the side without
/// them.
bool two_rows_decide(const WholeNode& node, const Side& side, const Side& without);

/// Coefficients of least squares of y on the columns of `regressors`.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& regressors, const Eigen::VectorXd& y);

struct Split {
  int input = -1;
  double low = 0.0;  // the gap
  double high = 0.0;
  long double rss = std::numeric_limits<long double>::infinity();
  long double adjusted = std::numeric_limits<long double>::infinity();
};

/// Refits both children of every admissible split in which no two rows next to the split decide a direction of a child.
Split best_split(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, Eigen::Index min_leaf, long double tie_tolerance);

inline Eigen::MatrixXd uniform(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  llmt::Random random(seed);
  Eigen::MatrixXd values(rows, columns);
  for (double& value : values.reshaped()) {
    value = random.uniform(-1.0, 1.0);
  }
  return values;
}

/// `x` with the largest and the smallest value of every column twice: the guard that does not follow a slope to a
/// single outermost row has nothing to hold then on these rows.
inline Eigen::MatrixXd firm(Eigen::MatrixXd x) {
  for (auto column : x.colwise()) {
    for (const double sign : {1.0, -1.0}) {
      Eigen::Index first = 0;
      const double outermost = (sign * column).maxCoeff(&first);
      const double kept = column(first);
      column(first) = -sign * std::numeric_limits<double>::infinity();
      Eigen::Index second = 0;
      (sign * column).maxCoeff(&second);
      column(first) = kept;
      column(second) = sign * outermost;
    }
  }
  return x;
}

/// Values on a grid of 2^-20: adding 1e6 to inputs or 1e8 to outputs, or scaling by powers of two, rounds nothing.
inline Eigen::MatrixXd coarse(const Eigen::MatrixXd& values) {
  return (values * 0x1p20).array().round().matrix() * 0x1p-20;
}

/// A curved, kinked target of the first two columns.
inline Eigen::MatrixXd curved(const Eigen::MatrixXd& x, double noise = 0.0, std::uint64_t seed = 7) {
  llmt::Random random(seed);
  Eigen::MatrixXd y(x.rows(), 1);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    y(i, 0) = std::sin(3.0 * x(i, 0)) + std::abs(x(i, 1) - 0.2) + 0.3 * x(i, x.cols() - 1) + noise * random.normal();
  }
  return y;
}

}  // namespace oracle
