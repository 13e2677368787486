#include "numerics/chebyshev.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace llmt {
namespace {

// Coefficients below this part of the largest, or of the level, are rounding.
constexpr double rounding_of_coefficients = 1e-14;

// An eigenvalue that is real or within the interval but for rounding. A double zero is exact to the root of that.
constexpr double slack_of_zero = 1e-7;

double angle_of_point(Eigen::Index k, Eigen::Index count) {
  return std::numbers::pi * (static_cast<double>(k) + 0.5) / static_cast<double>(count);
}

}  // namespace

std::vector<double> chebyshev_points(int degree) {
  std::vector<double> points;
  for (int k = 0; k <= degree; ++k) {
    points.push_back(0.5 * (1.0 - std::cos(angle_of_point(k, degree + 1))));
  }
  return points;
}

Eigen::VectorXd chebyshev_coefficients(const Eigen::VectorXd& values) {
  const Eigen::Index count = values.size();
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    for (Eigen::Index i = 0; i < count; ++i) {
      // The points run from -1 to 1, the angles from 0 to pi: T_k(-cos(t)) = (-1)^k cos(k t).
      const double sign = k % 2 == 0 ? 1.0 : -1.0;
      coefficients(k) += sign * values(i) * std::cos(static_cast<double>(k) * angle_of_point(i, count));
    }
    coefficients(k) *= (k == 0 ? 1.0 : 2.0) / static_cast<double>(count);
  }
  return coefficients;
}

std::vector<double> positions_of_level(Eigen::VectorXd coefficients, double level) {
  const double rounding = rounding_of_coefficients * std::max(coefficients.cwiseAbs().maxCoeff(), std::abs(level));
  coefficients(0) -= level;
  // |T_k| <= 1: the level is too far away.
  const Eigen::Index highest = coefficients.size() - 1;
  if (!coefficients.allFinite() || std::abs(coefficients(0)) > coefficients.tail(highest).cwiseAbs().sum()) return {};
  Eigen::Index degree = highest;
  while (degree > 0 && std::abs(coefficients(degree)) <= rounding) --degree;
  if (degree == 0) return {};
  // x T_k = (T_(k-1) + T_(k+1)) / 2, with T_degree replaced by what the polynomial says of it at a zero.
  Eigen::MatrixXd colleague = Eigen::MatrixXd::Zero(degree, degree);
  for (Eigen::Index k = 0; k < degree; ++k) {
    const double part = k == 0 ? 1.0 : 0.5;
    if (k > 0) colleague(k, k - 1) = part;
    if (k + 1 < degree) {
      colleague(k, k + 1) = part;
    } else {
      colleague.row(k) -= part / coefficients(degree) * coefficients.head(degree).transpose();
    }
  }
  std::vector<double> positions;
  for (const auto& zero : colleague.eigenvalues()) {
    if (std::abs(zero.imag()) <= slack_of_zero && std::abs(zero.real()) <= 1.0 + slack_of_zero) {
      positions.push_back(std::clamp(0.5 * (1.0 + zero.real()), 0.0, 1.0));
    }
  }
  std::ranges::sort(positions);
  return positions;
}

}  // namespace llmt
