/// \file
/// Median, standard deviation, and the mean of paired differences with its standard error.
///
///     const Eigen::Vector3d before(0.30, 0.25, 0.40);
///     const Eigen::Vector3d after(0.20, 0.10, 0.35);
///     const bool is_better = llmt::paired_difference(before, after).is_beyond_chance();
///     const double typical = llmt::median(before);
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "llmt/abi.hpp"

namespace llmt {

/// The middle one of n >= 1 values; of an even number the upper of the two.
inline double median(Eigen::VectorXd values) {
  const auto middle = values.begin() + values.size() / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// Mean of n differences d_i = a_i - b_i, and its standard error sqrt(sum (d_i - mean)^2 / (n - 1) / n); 0 for n = 1.
struct PairedDifference {
  double mean = 0.0;
  double standard_error = 0.0;

  /// The mean exceeds 0 by more than two standard errors.
  bool is_beyond_chance() const { return mean > 2.0 * standard_error; }
};

inline PairedDifference paired_difference(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::VectorXd difference = a - b;
  const auto n = static_cast<double>(difference.size());
  const double mean = difference.mean();
  if (difference.size() < 2) return {mean, 0.0};
  const double squares = (difference.array() - mean).square().sum();
  return {mean, std::sqrt(squares / (n - 1.0) / n)};
}

/// sqrt(sum (x_i - mean)^2 / (n - 1)) of n values; 0 for n < 2.
inline double spread_of(const Eigen::VectorXd& values) {
  if (values.size() < 2) return 0.0;
  return std::sqrt((values.array() - values.mean()).square().sum() / static_cast<double>(values.size() - 1));
}

}  // namespace llmt
