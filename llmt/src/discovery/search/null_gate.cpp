#include "discovery/search/null_gate.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "llmt/random.hpp"

namespace llmt::discovery {
namespace {

// Columns are draws.
struct Draws {
  Eigen::MatrixXd moments;  // K x draws: U'z
  Eigen::VectorXd squares;  // draws: |z|^2 after projection
};

Draws normal_draws(const Workspace& workspace, int count, Random& random) {
  const Eigen::Index n = workspace.residuals().size();
  const Eigen::Index k = workspace.basis().cols();
  Draws draws;
  const double free = std::max(1.0, workspace.degrees() - workspace.dropped_degrees());
  if (n <= 2 * k || n <= 1000) {
    Eigen::MatrixXd noise(n, count);
    for (double& value : noise.reshaped()) value = random.normal();
    workspace.project(noise);
    draws.squares = noise.colwise().squaredNorm().transpose();
    draws.moments.noalias() = workspace.basis().transpose() * noise;
    return draws;
  }
  // Long residuals: U'z has covariance G, and |z|^2 hardly varies.
  constexpr double jitter = 1e-9;
  Eigen::MatrixXd gram = workspace.gram();
  gram.diagonal().array() += jitter;
  const Eigen::LLT<Eigen::MatrixXd> factor(gram);
  Eigen::MatrixXd noise(k, count);
  for (double& value : noise.reshaped()) value = random.normal();
  draws.moments = factor.matrixL() * noise;
  draws.squares = Eigen::VectorXd::Constant(count, free);
  return draws;
}

Draws sign_draws(const Workspace& workspace, int count, Random& random) {
  const Eigen::Index d = workspace.components();
  const Eigen::Index n = workspace.samples();
  Eigen::MatrixXd weighted = workspace.basis();
  weighted.array().colwise() *= workspace.residuals().array();
  const std::vector<Eigen::Index>& cluster = workspace.clusters();
  const Eigen::Index clusters = *std::ranges::max_element(cluster) + 1;
  Eigen::MatrixXd by_cluster = Eigen::MatrixXd::Zero(clusters, weighted.cols());
  for (Eigen::Index i = 0; i < n; ++i) by_cluster.row(cluster[i]) += weighted.middleRows(i * d, d).colwise().sum();
  Eigen::MatrixXd signs(clusters, count);
  for (double& value : signs.reshaped()) value = random.bits() & 1 ? 1.0 : -1.0;
  Draws draws;
  draws.moments.noalias() = by_cluster.transpose() * signs;
  // |z|^2 - |Q'z|^2 of the flipped residuals.
  Eigen::MatrixXd flipped = workspace.baseline();
  flipped.array().colwise() *= workspace.residuals().array();
  Eigen::MatrixXd inside = Eigen::MatrixXd::Zero(clusters, flipped.cols());
  for (Eigen::Index i = 0; i < n; ++i) inside.row(cluster[i]) += flipped.middleRows(i * d, d).colwise().sum();
  const Eigen::MatrixXd absorbed = inside.transpose() * signs;
  draws.squares = (workspace.sum_of_squares() - absorbed.colwise().squaredNorm().transpose().array()).max(0.0).matrix();
  return draws;
}

// `independent`: share of the samples that the gain counts.
double best_gain(const Scoring& scoring, const Draws& draws, Eigen::Index draw, bool scanned, double independent) {
  const double n = scoring.workspace().degrees();
  double best = -impossible;
  for (std::size_t a = 0; a < scoring.candidates().size(); ++a) {
    if (!scoring.usable(a) || (!scanned && scoring.candidates()[a].prior_cost > 0.0)) continue;
    const Block& block = scoring.workspace().blocks()[a];
    const double share = draws.moments.col(draw).segment(block.begin, block.size).squaredNorm() / draws.squares(draw);
    const double outlier_free_cost = scoring.single_cost(a) - scoring.cost({});
    const double used = n * std::log(n / (n - static_cast<double>(block.size)));
    best = std::max(best, -independent * n * std::log(std::max(1e-12, 1.0 - share)) - used - outlier_free_cost);
  }
  return best;
}

double quantile_beyond(const Scoring& scoring, const Draws& draws, double rate, bool scanned, double independent) {
  constexpr double seen = 0.1;
  std::vector<double> gains;
  for (Eigen::Index i = 0; i < draws.moments.cols(); ++i)
    gains.push_back(best_gain(scoring, draws, i, scanned, independent));
  const auto place = gains.begin() + static_cast<Eigen::Index>((1.0 - seen) * static_cast<double>(gains.size()));
  std::ranges::nth_element(gains, place);
  return *place + 2.0 * std::log(seen / rate);
}

}  // namespace

double chance_gain(const Scoring& scoring, const SearchOptions& options) {
  if (scoring.workspace().basis().cols() == 0) return 0.0;
  Random random(options.seed);
  // Draws of independent noise count each sample; the flipped residuals are correlated as the noise is.
  const double normal = quantile_beyond(scoring, normal_draws(scoring.workspace(), options.null_draws, random),
                                        options.false_alarm_rate, true, 1.0);
  // A candidate that was placed where the largest residuals are stays near them whatever their signs.
  const double flipped = quantile_beyond(scoring, sign_draws(scoring.workspace(), options.null_draws, random),
                                         options.false_alarm_rate, false, scoring.workspace().independent_share());
  return std::max({0.0, normal, flipped});
}

}  // namespace llmt::discovery
