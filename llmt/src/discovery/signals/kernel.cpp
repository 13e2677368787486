#include "discovery/signals/kernel.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace llmt::discovery {
namespace {

constexpr int order = 3;       // of the polynomial in x that makes the gain flat: 1 - H is of the order x^4
constexpr double reach = 7.0;  // widths; the kernel is below 1e-7 of its height there

// exp(-x) (1 + x + x^2/2 + x^3/6) = 1/sqrt(2)
constexpr double x_at_cutoff = 2.7316309509324466;

// Integral of H^4 by that of H^2 squared, over all frequencies, for a width of 1.
constexpr double widths_between_independent_rows = 1.1632840160941975;

// Derivative `r` of the kernel of width 1: with g the normal density and He the Hermite polynomials
//   (-1)^r g(u) sum_k (-1)^k / (2^k k!) He_{2k+r}(u).
double kernel_value(double u, int r) {
  std::array<double, 2 * order + 3> hermite{1.0, u};
  for (int n = 1; n + 1 < std::ssize(hermite); ++n) hermite[n + 1] = u * hermite[n] - n * hermite[n - 1];
  double sum = 0.0;
  double factor = r == 1 ? -1.0 : 1.0;
  for (int k = 0; k <= order; ++k) {
    sum += factor * hermite[2 * k + r];
    factor /= -2.0 * (k + 1);
  }
  return sum * std::exp(-0.5 * u * u) / std::sqrt(2.0 * std::numbers::pi);
}

}  // namespace

double width_of(double cutoff) { return std::sqrt(2.0 * x_at_cutoff) / (2.0 * std::numbers::pi * cutoff); }

Eigen::Index half_length(double cutoff, double step) {
  return static_cast<Eigen::Index>(std::ceil(reach * width_of(cutoff) / step));
}

Eigen::Index independent_step(double cutoff, double step) {
  const double samples = widths_between_independent_rows * width_of(cutoff) / step;
  return std::max<Eigen::Index>(1, static_cast<Eigen::Index>(std::lround(samples)));
}

Kernel kernel_of(double cutoff, double step) {
  const double width = width_of(cutoff);
  Kernel kernel;
  kernel.half = half_length(cutoff, step);
  const Eigen::Index length = 2 * kernel.half + 1;
  kernel.weights.resize(length, 3);
  const Eigen::ArrayXd offsets =
      step * Eigen::ArrayXd::LinSpaced(length, -static_cast<double>(kernel.half), static_cast<double>(kernel.half));
  for (Eigen::Index j = 0; j < length; ++j) {
    // The sample at t + offset has the weight kernel(-offset).
    for (int r = 0; r < 3; ++r) {
      kernel.weights(j, r) = step * kernel_value(-offsets(j) / width, r) / std::pow(width, r + 1);
    }
  }
  // The tail that is cut off must not turn a large constant into an acceleration: 1, t and t^2/2 come out exactly.
  auto value = kernel.weights.col(0);
  auto first = kernel.weights.col(1);
  auto second = kernel.weights.col(2);
  value /= value.sum();
  first /= first.dot(offsets.matrix());
  second.array() -= second.mean();
  second /= 0.5 * second.dot(offsets.square().matrix());
  Eigen::Index lobe = 0;
  while (lobe < kernel.half && value(kernel.half + lobe) > 0.0) ++lobe;
  kernel.lobe = static_cast<double>(lobe) * step;
  return kernel;
}

Eigen::VectorXd low_pass(double cutoff, double step) {
  constexpr double near = 5.0;  // beyond it is a thousandth of the kernel
  const double width = width_of(cutoff);
  const auto half = static_cast<Eigen::Index>(std::floor(near * width / step));
  Eigen::VectorXd weights(2 * half + 1);
  for (Eigen::Index k = -half; k <= half; ++k)
    weights(half + k) = kernel_value(static_cast<double>(k) * step / width, 0);
  return weights / weights.sum();
}

Eigen::Vector3d uncorrelated_neighbours(double cutoff, double step, Eigen::Index stride) {
  const Kernel kernel = kernel_of(cutoff, step);
  const Eigen::VectorXd low = low_pass(cutoff, step);
  const Eigen::Index length = kernel.weights.rows();
  Eigen::Matrix3d equations;
  equations.row(0).setOnes();
  for (Eigen::Index r = 1; r < 3; ++r) {
    const auto once = kernel.weights.col(r);
    Eigen::VectorXd twice = Eigen::VectorXd::Zero(length + low.size() - 1);
    for (Eigen::Index k = 0; k < low.size(); ++k) twice.segment(k, length) += low(k) * once;
    const auto covariance = [&](Eigen::Index lag) {
      double sum = 0.0;
      for (Eigen::Index j = 0; j < length; ++j) {
        const Eigen::Index place = j + low.size() / 2 + lag;
        if (place < twice.size()) sum += once(j) * twice(place);
      }
      return sum;
    };
    for (Eigen::Index m = 0; m < 3; ++m) equations(r, m) = covariance((m + 1) * stride) / covariance(0);
  }
  return equations.partialPivLu().solve(Eigen::Vector3d(1.0, 0.0, 0.0));
}

double correlation_at(const Kernel& kernel, Eigen::Index lag) {
  const auto value = kernel.weights.col(0);
  const Eigen::Index shared = value.size() - lag;
  return shared > 0 ? value.head(shared).dot(value.tail(shared)) / value.squaredNorm() : 0.0;
}

}  // namespace llmt::discovery
