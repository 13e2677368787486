#include "discovery/recording/noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "discovery/recording/derivatives.hpp"

namespace llmt::discovery {
namespace {

struct Lagged {
  double product = 0.0;  // mean over the pairs
  double pairs = 0.0;
};

Lagged lagged(const Eigen::VectorXd& values, const std::vector<Eigen::Index>& stretches, const std::vector<bool>& used,
              Eigen::Index lag) {
  Lagged result;
  for (Eigen::Index i = 0; i + lag < values.size(); ++i) {
    if (stretches[i] != stretches[i + lag] || !used[i] || !used[i + lag]) continue;
    result.product += values(i) * values(i + lag);
    result.pairs += 1.0;
  }
  if (result.pairs > 0.0) result.product /= result.pairs;
  return result;
}

double variance_of(const Eigen::VectorXd& values) {
  return values.size() < 2 ? 0.0 : (values.array() - values.mean()).square().mean();
}

// Mean over the pieces, weighted by rows; NaN where no piece is long enough.
double noise_variance_in(const std::vector<Piece>& pieces, const Eigen::VectorXd& values) {
  double sum = 0.0;
  double weight = 0.0;
  for (const Piece& piece : pieces) {
    const double own = noise_variance(values(piece));
    if (std::isnan(own)) continue;
    sum += own * static_cast<double>(piece.size());
    weight += static_cast<double>(piece.size());
  }
  return weight > 0.0 ? sum / weight : std::numeric_limits<double>::quiet_NaN();
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

// Divided differences within recordings, a row each, weighted so that white noise has the same variance in them. Of a
// signal of 12 rows a period those of order 8 leave 1e-4, of a slower one less: the motion is not in them.
Eigen::MatrixXd differences_of_order(Eigen::Index order, const Rows& rows, const Eigen::MatrixXd& values) {
  const std::vector<Recorded> recorded = recordings(rows);
  const auto n = std::ssize(rows.sequence);
  Eigen::MatrixXd all(n, values.cols());
  Eigen::Index count = 0;
  for (Eigen::Index k = 0; k + order < n; ++k) {
    if (recorded[k].begin != recorded[k + order].begin) continue;
    const std::vector<Eigen::Index> window(rows.sequence.begin() + k, rows.sequence.begin() + k + order + 1);
    const Eigen::ArrayXd times = rows.instants(window) / (rows.instants(window.back()) - rows.instants(window.front()));
    Eigen::VectorXd weights(order + 1);
    for (Eigen::Index i = 0; i <= order; ++i) {
      double product = 1.0;
      for (Eigen::Index j = 0; j <= order; ++j) product *= j == i ? 1.0 : times(i) - times(j);
      weights(i) = 1.0 / product;
    }
    all.row(count++) = weights.normalized().transpose() * values(window, Eigen::all);
  }
  all.conservativeResize(count, Eigen::NoChange);
  return all;
}

}  // namespace

double noise_variance(const Eigen::VectorXd& values) {
  const Eigen::Index n = values.size();
  if (n < 4) return std::numeric_limits<double>::quiet_NaN();
  const Eigen::ArrayXd third = values.tail(n - 3).array() - 3.0 * values.segment(2, n - 3).array() +
                               3.0 * values.segment(1, n - 3).array() - values.head(n - 3).array();
  return third.square().mean() / 20.0;
}

std::vector<Signal> signals_of(const std::vector<Piece>& pieces, const Eigen::MatrixXd& values) {
  std::vector<Signal> all;
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    const Eigen::VectorXd column = values.col(j);
    const Signal own{j, variance_of(column), noise_variance_in(pieces, column)};
    if (own.variance > 0.0 && !std::isnan(own.noise)) all.push_back(own);
  }
  return all;
}

Eigen::Index smooth_lag(const Rows& rows, const Eigen::MatrixXd& signals) {
  constexpr double largest_change = 0.18;
  constexpr Eigen::Index least = 2;
  const auto n = std::ssize(rows.sequence);
  Eigen::Index lag = n / 20;
  for (Eigen::Index j = 0; j < signals.cols(); ++j) {
    if (n < 8) return least;
    const Eigen::ArrayXd v = Eigen::VectorXd(signals.col(j))(rows.sequence).array();
    const double variance = (v - v.mean()).square().mean();
    const double noise = noise_variance(v.matrix());
    if (!(variance > 0.0) || noise > largest_noise_of_smooth * variance) continue;
    Eigen::Index own = 1;
    while (own < lag && 0.5 * (v.tail(n - own - 1) - v.head(n - own - 1)).square().mean() - noise <=
                            largest_change * (variance - noise)) {
      ++own;
    }
    lag = own;
  }
  return std::max(least, lag);
}

Eigen::MatrixXd noise_in_time(const Rows& rows, const Inputs& inputs) {
  constexpr double jump = 5.0;  // robust standard deviations
  constexpr double normal_median = 0.6745;
  const Eigen::Index p = inputs.values.cols();
  constexpr Eigen::Index fewest = 50;
  Eigen::MatrixXd differences;
  for (const Eigen::Index order : {8, 6, 4}) {  // short recordings have none of a high order
    differences = differences_of_order(order, rows, inputs.values);
    if (differences.rows() >= fewest) break;
  }
  if (differences.rows() < fewest) return Eigen::MatrixXd::Zero(p, p);
  Eigen::VectorXd limits(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    const Eigen::VectorXd own = differences.col(j).cwiseAbs();
    limits(j) = jump * median({own.begin(), own.end()}) / normal_median;
    if (!(limits(j) > 0.0)) limits(j) = own.maxCoeff();  // most are equal: an encoder at rest
  }
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(p, p);
  double count = 0.0;
  for (Eigen::Index i = 0; i < differences.rows(); ++i) {
    if ((differences.row(i).transpose().cwiseAbs().array() > limits.array()).any()) continue;
    sum += differences.row(i).transpose() * differences.row(i);
    count += 1.0;
  }
  Eigen::MatrixXd covariance = count > 0.0 ? Eigen::MatrixXd(sum / count) : Eigen::MatrixXd::Zero(p, p);
  for (Eigen::Index j = 0; j < p; ++j) {
    const double variance = (inputs.values.col(j).array() - inputs.values.col(j).mean()).square().mean();
    constexpr double rounding = 1e-12;
    const bool is_noise =
        covariance(j, j) > rounding * variance && covariance(j, j) <= largest_noise_of_smooth * variance;
    if (inputs.names[j] != inputs.order && is_noise) continue;
    covariance.row(j).setZero();
    covariance.col(j).setZero();
  }
  return covariance;
}

Eigen::MatrixXd covariance_of_errors(const Rows& rows, const Inputs& inputs) {
  const Eigen::Index p = inputs.values.cols();
  const bool in_time = inputs.instants.size() > 0;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(p, p);
  if (in_time) covariance = noise_in_time(rows, inputs);
  for (Eigen::Index j = 0; j < inputs.noise.size(); ++j) {
    const double given = inputs.noise(j);
    if (std::isnan(given)) continue;
    const double own = std::sqrt(covariance(j, j));
    const double factor = own > 0.0 ? given / own : 0.0;
    // Filtered rows share their errors with their neighbours, so differences say nothing of them.
    covariance.row(j) *= inputs.cutoff > 0.0 ? 0.0 : factor;
    covariance.col(j) *= inputs.cutoff > 0.0 ? 0.0 : factor;
    covariance(j, j) = given * given;
  }
  return covariance;
}

std::vector<double> autocorrelation(const Eigen::VectorXd& values, const std::vector<Eigen::Index>& stretches,
                                    const std::vector<bool>& used) {
  std::vector<double> correlation;
  const double variance = lagged(values, stretches, used, 0).product;
  if (!(variance > 0.0)) return correlation;
  const Eigen::Index most = values.size() / 4;
  for (Eigen::Index lag = 1; lag <= most; ++lag) {
    const Lagged own = lagged(values, stretches, used, lag);
    constexpr double significant = 1.65;
    constexpr double fewest_pairs = 10.0;
    if (own.pairs < fewest_pairs) break;
    const double rho = own.product / variance;
    if (rho < significant / std::sqrt(own.pairs)) break;
    correlation.push_back(std::min(1.0, rho));
  }
  return correlation;
}

double independent_share(const std::vector<double>& correlation) {
  double sum = 1.0;
  for (const double rho : correlation) sum += 2.0 * rho;
  return 1.0 / sum;
}

double variance_inflation(const std::vector<double>& correlation, const Eigen::VectorXd& influences,
                          const std::vector<Eigen::Index>& stretches) {
  const std::vector<bool> all(influences.size(), true);
  const double own = lagged(influences, stretches, all, 0).product;
  double sum = 1.0;
  for (std::size_t k = 0; k < correlation.size() && own > 0.0; ++k) {
    const double r = lagged(influences, stretches, all, static_cast<Eigen::Index>(k) + 1).product / own;
    sum += 2.0 * correlation[k] * r;
  }
  return std::max(1.0, sum);
}

}  // namespace llmt::discovery
