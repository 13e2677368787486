#include "discovery/signals/noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace llmt::discovery {
namespace {

// Of a signal below the cutoff, differences of order 8 at four times the cutoff leave less than 1e-5.
constexpr double binomials[] = {1, -8, 28, -56, 70, -56, 28, -8, 1};
constexpr double squares_of_binomials = 12870.0;

// Of white noise that is differenced so, samples for one independent square: mean^2 by mean square of sin^16.
constexpr double correlated = 1.81;

// Sums of `count` consecutive samples, by doubling: a million rows far above the cutoff have means over hundreds.
Eigen::VectorXd sums_of(const Eigen::VectorXd& samples, Eigen::Index count) {
  const Eigen::Index n = samples.size() - count + 1;
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd doubled = samples;  // sums of `length` samples
  Eigen::Index begin = 0;
  for (Eigen::Index length = 1; length <= count; length *= 2) {
    if ((count & length) != 0) {
      sums += doubled.segment(begin, n);
      begin += length;
    }
    const Eigen::Index next = doubled.size() - length;
    if (next <= 0) break;
    doubled = (doubled.head(next) + doubled.tail(next)).eval();
  }
  return sums;
}

// Differences of order 8 of means of `stride` consecutive samples, scaled to the variance of white noise.
Eigen::VectorXd differences_of(const Eigen::VectorXd& samples, Eigen::Index stride) {
  const Eigen::Index n = samples.size() - 9 * stride + 1;
  if (n <= 0) return {};
  const Eigen::VectorXd sums = sums_of(samples, stride);
  Eigen::VectorXd differences = Eigen::VectorXd::Zero(n);
  for (Eigen::Index k = 0; k <= 8; ++k) differences += binomials[k] * sums.segment(k * stride, n);
  return differences / std::sqrt(squares_of_binomials * static_cast<double>(stride));
}

struct Strength {
  double variance = 0.0;  // of white noise as strong
  double standard_error = std::numeric_limits<double>::infinity();
};

Strength strength_at(const std::vector<Eigen::VectorXd>& stretches, Eigen::Index stride, Eigen::Index window) {
  std::vector<double> means;
  Eigen::Index count = 0;
  for (const Eigen::VectorXd& samples : stretches) {
    const Eigen::VectorXd differences = differences_of(samples, stride);
    const Eigen::Index n = differences.size();
    if (n == 0) continue;
    count += n;
    const Eigen::Index windows = std::max<Eigen::Index>(n / window, 1);
    for (Eigen::Index w = 0; w < windows; ++w) {
      const Eigen::Index begin = w * n / windows;
      const Eigen::Index end = (w + 1) * n / windows;
      means.push_back(differences.segment(begin, end - begin).squaredNorm() / static_cast<double>(end - begin));
    }
  }
  if (means.empty()) return {};
  const auto middle = means.begin() + std::ssize(means) / 2;
  std::ranges::nth_element(means, middle);
  // The median of a mean of k squares of normal numbers (Wilson and Hilferty 1931).
  const double per_square = correlated * static_cast<double>(stride);
  const double k = std::max(1.0, static_cast<double>(window) / per_square);
  const double variance = *middle / std::pow(1.0 - 2.0 / (9.0 * k), 3.0);
  // A median varies by pi / 2 of the variance of a mean.
  return {variance, variance * std::sqrt(std::numbers::pi * per_square / static_cast<double>(count))};
}

}  // namespace

double noise_at_cutoff(const std::vector<Eigen::VectorXd>& stretches, double cutoff, double step) {
  // Short windows avoid jumps, long ones the rounding of a coarse sensor, which leaves a slow signal constant.
  constexpr Eigen::Index shortest = 20;
  constexpr Eigen::Index at_the_end = 50;
  constexpr Eigen::Index strides = 8;  // in a window
  const double flat = strength_at(stretches, 1, at_the_end).variance;
  double rise = std::numeric_limits<double>::infinity();
  for (auto stride = static_cast<Eigen::Index>(std::lround(0.125 / (cutoff * step))); stride > 1; stride /= 2) {
    const Strength here = strength_at(stretches, stride, std::max(shortest, strides * stride));
    if (here.variance == 0.0) continue;
    const double frequency = 0.5 / (static_cast<double>(stride) * step * cutoff);
    rise = std::min(rise, (here.variance - flat - 3.0 * here.standard_error) * frequency * frequency);
  }
  return std::sqrt(flat + (std::isfinite(rise) ? std::max(0.0, rise) : 0.0));
}

}  // namespace llmt::discovery
