#include "discovery/recording/derivatives.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace llmt::discovery {
namespace {

// Share of the variance of b that the derivative of a explains, and the time unit of b in that of the instants.
struct Likeness {
  double share = 0.0;
  double unit = 0.0;
};

Likeness likeness(const Eigen::VectorXd& derivative, const Eigen::VectorXd& b) {
  const double own = derivative.squaredNorm() * b.squaredNorm();
  const double common = derivative.dot(b);
  if (!(own > 0.0) || !(common > 0.0)) return {};
  return {common * common / own, b.squaredNorm() / common};
}

}  // namespace

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
    if (before.size() != times.size() || (before - times).cwiseAbs().maxCoeff() > same_time) {
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

std::vector<Motion> motions(const Derivatives& derivatives, const Inputs& inputs) {
  constexpr double of_speeds = 0.9;
  constexpr double of_accelerations = 0.7;  // they are noisier
  constexpr double unlike_units = 1.5;
  const Eigen::Index p = inputs.values.cols();
  std::vector<Eigen::VectorXd> first;
  for (Eigen::Index j = 0; j < p; ++j) first.push_back(derivatives.first(inputs.values.col(j)));
  const auto successor = [&](Eigen::Index a, double least) -> std::pair<Eigen::Index, Likeness> {
    std::pair<Eigen::Index, Likeness> best{-1, {}};
    for (Eigen::Index b = 0; b < p; ++b) {
      if (b == a || inputs.names[b] == inputs.order) continue;
      const Likeness own = likeness(first[a], inputs.values.col(b));
      if (own.share >= least && own.share > best.second.share) best = {b, own};
    }
    return best;
  };
  std::vector<Motion> all;
  for (Eigen::Index a = 0; a < p; ++a) {
    if (inputs.names[a] == inputs.order) continue;
    const auto [b, speed] = successor(a, of_speeds);
    if (b < 0) continue;
    const auto [c, acceleration] = successor(b, of_accelerations);
    if (c < 0 || c == a) continue;
    const double ratio = speed.unit / acceleration.unit;
    if (ratio < 1.0 / unlike_units || ratio > unlike_units) continue;
    all.push_back({a, b, c, speed.unit});
  }
  return all;
}

bool is_derivative_of(const Derivatives& derivatives, const Eigen::VectorXd& input, const Eigen::VectorXd& output) {
  constexpr double alike = 0.8;
  return likeness(derivatives.first(output), input).share >= alike ||
         likeness(derivatives.second(output), input).share >= alike;
}

}  // namespace llmt::discovery
