#include "discovery/terms/derivatives.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace llmt::discovery {

double median_step(const Rows& rows) {
  std::vector<double> steps;
  for (std::size_t k = 1; k < rows.sequence.size(); ++k) {
    const double step = rows.instants(rows.sequence[k]) - rows.instants(rows.sequence[k - 1]);
    if (step > 0.0) steps.push_back(step);
  }
  if (steps.empty()) return 0.0;
  std::ranges::nth_element(steps, steps.begin() + std::ssize(steps) / 2);
  return steps[steps.size() / 2];
}

std::vector<Recorded> recordings(const Rows& rows) {
  const auto n = std::ssize(rows.sequence);
  std::vector<Recorded> all(n);
  const double longest = interruption * median_step(rows);
  if (!(longest > 0.0)) return all;
  Eigen::Index begin = 0;
  for (Eigen::Index k = 1; k <= n; ++k) {
    const double step = k < n ? rows.instants(rows.sequence[k]) - rows.instants(rows.sequence[k - 1]) : 0.0;
    if (k < n && step > 0.0 && step <= longest) continue;
    for (Eigen::Index i = begin; i < k; ++i) all[i] = {begin, k};
    begin = k;
  }
  return all;
}

Derivatives::Derivatives(const Rows& rows, Eigen::Index half)
    : sequence_(rows.sequence), recorded_(recordings(rows)), times_(rows.instants(rows.sequence)) {
  const std::vector<Recorded>& extent = recorded_;
  const auto n = std::ssize(sequence_);
  stencils_.resize(n);
  Eigen::VectorXd before;
  std::shared_ptr<const Eigen::MatrixXd> weights;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Index begin = std::max(extent[k].begin, k - half);
    const Eigen::Index end = std::min(extent[k].end, k + half + 1);
    // Beyond one end of a window a polynomial of high degree is anything.
    const Eigen::Index most_powers = end - begin == 2 * half + 1 ? 5 : 3;
    const Eigen::Index powers = std::min(most_powers, end - begin);
    stencils_[k].begin = begin;
    if (powers < 2) continue;
    Eigen::VectorXd times(end - begin);
    for (Eigen::Index i = begin; i < end; ++i) {
      times(i - begin) = rows.instants(sequence_[i]) - rows.instants(sequence_[k]);
    }
    const double width = times.cwiseAbs().maxCoeff();
    times /= width;
    constexpr double same = 1e-7;
    if (before.size() != times.size() || (before - times).cwiseAbs().maxCoeff() > same) {
      Eigen::MatrixXd basis = Eigen::MatrixXd::Ones(times.size(), powers);
      for (Eigen::Index q = 1; q < powers; ++q) basis.col(q) = basis.col(q - 1).cwiseProduct(times);
      // Times within -1 ... 1 and few powers: the normal equations lose few digits.
      const Eigen::MatrixXd inverse = (basis.transpose() * basis).ldlt().solve(basis.transpose());
      weights = std::make_shared<const Eigen::MatrixXd>(inverse);
      before = times;
    }
    stencils_[k].width = width;
    stencils_[k].weights = weights;
  }
}

Eigen::VectorXd Derivatives::apply(int order, const Eigen::VectorXd& values) const {
  const Eigen::VectorXd in_time = values(sequence_);
  Eigen::VectorXd result = Eigen::VectorXd::Zero(values.size());
  Eigen::VectorXd weights;
  for (std::size_t k = 0; k < stencils_.size(); ++k) {
    const Stencil& own = stencils_[k];
    if (own.weights == nullptr || own.weights->rows() <= order) continue;
    if (order == 1) {
      weights = own.weights->row(1).transpose() / own.width;
    } else {
      weights = 2.0 * own.weights->row(2).transpose() / (own.width * own.width);
    }
    result(sequence_[k]) = weights.dot(in_time.segment(own.begin, weights.size()));
  }
  return result;
}

Eigen::VectorXd Derivatives::earlier(const Eigen::VectorXd& values, double by) const {
  const Eigen::VectorXd in_time = values(sequence_);
  Eigen::VectorXd result = values;
  for (Eigen::Index k = 0; k < std::ssize(stencils_); ++k) {
    const auto begin = times_.begin() + recorded_[k].begin;
    const auto end = times_.begin() + recorded_[k].end;
    if (begin == end) continue;
    const double time = std::clamp(times_(k) - by, *begin, *(end - 1));
    auto nearest = std::lower_bound(begin, end, time);
    if (nearest == end || (nearest != begin && time - *(nearest - 1) < *nearest - time)) --nearest;
    const Eigen::Index place = nearest - times_.begin();
    const Stencil& own = stencils_[place];
    if (own.weights == nullptr) {
      result(sequence_[k]) = in_time(place);
      continue;
    }
    const Eigen::VectorXd coefficients = *own.weights * in_time.segment(own.begin, own.weights->cols());
    const double x = (time - times_(place)) / own.width;
    double value = 0.0;
    for (Eigen::Index q = coefficients.size(); q-- > 0;) value = value * x + coefficients(q);
    result(sequence_[k]) = value;
  }
  return result;
}

Eigen::Index smooth_lag(const Rows& rows, const Eigen::MatrixXd& signals) {
  constexpr double largest_noise_share = 0.4;
  constexpr double largest_change = 0.18;
  constexpr Eigen::Index least = 2;
  const auto n = std::ssize(rows.sequence);
  Eigen::Index lag = n / 20;
  for (Eigen::Index j = 0; j < signals.cols(); ++j) {
    if (n < 8) return least;
    const Eigen::ArrayXd v = Eigen::VectorXd(signals.col(j))(rows.sequence).array();
    const double variance = (v - v.mean()).square().mean();
    const Eigen::ArrayXd third = v.tail(n - 3) - 3.0 * v.segment(2, n - 3) + 3.0 * v.segment(1, n - 3) - v.head(n - 3);
    const double noise = third.square().mean() / 20.0;
    if (!(variance > 0.0) || noise > largest_noise_share * variance) continue;
    Eigen::Index own = 1;
    while (own < lag && 0.5 * (v.tail(n - own - 1) - v.head(n - own - 1)).square().mean() - noise <=
                            largest_change * (variance - noise)) {
      ++own;
    }
    lag = own;
  }
  return std::max(least, lag);
}

}  // namespace llmt::discovery
