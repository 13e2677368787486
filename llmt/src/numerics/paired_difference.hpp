/// \file
/// Two methods' errors on the same folds.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace llmt {

/// Mean of the K differences d_k = a_k - b_k and its standard error, sqrt(sum (d_k - mean)^2 / (K - 1) / K); 0 for K
/// = 1.
struct PairedDifference {
  double mean = 0.0;
  double standard_error = 0.0;
};

inline PairedDifference paired_difference(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::VectorXd difference = a - b;
  const double folds = static_cast<double>(difference.size());
  const double mean = difference.mean();
  if (difference.size() < 2) return {mean, 0.0};
  const double squares = (difference.array() - mean).square().sum();
  return {mean, std::sqrt(squares / (folds - 1.0) / folds)};
}

/// Standard deviation of the folds' errors; 0 for one fold.
inline double spread_of(const Eigen::VectorXd& errors) {
  if (errors.size() < 2) return 0.0;
  return std::sqrt((errors.array() - errors.mean()).square().sum() / static_cast<double>(errors.size() - 1));
}

}  // namespace llmt
