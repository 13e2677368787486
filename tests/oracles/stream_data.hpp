/// \file
/// Data that streams are tested on.
#pragma once

#include <Eigen/Core>

#include "llmt/random.hpp"

namespace stream_data {

inline Eigen::MatrixXd noise(Eigen::Index rows, std::uint64_t seed) {
  llmt::Random random(seed);
  Eigen::MatrixXd values(rows, 1);
  for (double& value : values.reshaped()) {
    value = random.normal();
  }
  return values;
}

inline Eigen::MatrixXd affine(const Eigen::MatrixXd& x) {
  return (1.5 + (x * Eigen::VectorXd::LinSpaced(x.cols(), -1.0, 2.0)).array()).matrix();
}

/// A kink in the first input.
inline Eigen::MatrixXd kink(const Eigen::MatrixXd& x) { return 2.0 * x.col(0).cwiseAbs() + 0.5 * x.col(1); }

inline Eigen::MatrixXd with_one(const Eigen::MatrixXd& x) {
  Eigen::MatrixXd result(x.rows(), x.cols() + 1);
  result << Eigen::VectorXd::Ones(x.rows()), x;
  return result;
}

}  // namespace stream_data
