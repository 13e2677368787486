/// \file
/// The piecewise smooth function that the benchmarks learn.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "llmt/random.hpp"

namespace bench {

/// x uniform on [0, 1]^inputs, truth(x), and y = truth(x) + N(0, 1).
struct Sample {
  Eigen::MatrixXd x;
  Eigen::VectorXd truth;
  Eigen::VectorXd y;
};

/// A function of the first nine inputs. An input that x does not have counts as 0.5.
inline double truth(const Eigen::VectorXd& x) {
  const auto at = [&](Eigen::Index j) { return j < x.size() ? x(j) : 0.5; };
  const double pieces = at(0) < 0.4 ? 10.0 * std::sin(std::numbers::pi * at(1) * at(2)) + 5.0 * at(3)
                                    : 20.0 * (at(4) - 0.5) * (at(4) - 0.5) + 10.0 * at(5) * at(6) - 5.0;
  return pieces + 8.0 * std::max(0.0, at(7) - 0.6) + 2.0 * at(8);
}

inline Sample sample(Eigen::Index rows, Eigen::Index inputs, std::uint64_t seed) {
  llmt::Random random(seed);
  Sample result{Eigen::MatrixXd(rows, inputs), Eigen::VectorXd(rows), Eigen::VectorXd(rows)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < inputs; ++j) result.x(i, j) = random.uniform();
    result.truth(i) = truth(result.x.row(i).transpose());
    result.y(i) = result.truth(i) + random.normal();
  }
  return result;
}

/// Root mean square difference from the truth, in the unit of the output.
inline double error(const Eigen::MatrixXd& predicted, const Sample& test) {
  return std::sqrt((predicted.col(0) - test.truth).squaredNorm() / static_cast<double>(test.truth.size()));
}

}  // namespace bench
