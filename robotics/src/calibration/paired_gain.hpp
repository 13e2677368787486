// Whether a model is better than another one on the same poses.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace llmt::robotics {

/// Mean of n paired differences, and its standard error sqrt(sum (d - mean)^2 / (n - 1) / n).
struct PairedGain {
  double mean = 0.0;
  double standard_error = 0.0;

  /// The mean exceeds 0 by more than two standard errors.
  bool is_beyond_chance() const { return mean > 2.0 * standard_error; }
};

/// Of the distances `before` minus those `after`, n values each.
inline PairedGain paired_gain(const Eigen::VectorXd& before, const Eigen::VectorXd& after) {
  const Eigen::ArrayXd gain = (before - after).array();
  const auto n = static_cast<double>(gain.size());
  return {gain.mean(), std::sqrt((gain - gain.mean()).square().sum() / (n - 1.0) / n)};
}

}  // namespace llmt::robotics
