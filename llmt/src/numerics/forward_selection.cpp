#include "numerics/forward_selection.hpp"

#include <algorithm>
#include <cmath>

namespace llmt {
namespace {

// A regressor is passed over if the chosen ones leave less than this part of its variance.
constexpr double least_new_variance = 1e-8;

// Gains that differ by less than this part of them are equal.
constexpr double tie_tolerance = 1e-10;

// A model is tried only with more rows than its coefficients and these: AICc has a pole at two.
constexpr double least_spare_rows = 3.0;

// A residual sum of squares below this part of that about the mean is rounding.
constexpr double rounding_of_squares = 1e-13;

// The search ends when ten further regressors have not lowered AICc.
constexpr int regressors_without_gain = 10;

// The part of the correlations of regressors and outputs that the chosen regressors do not explain.
struct Remaining {
  Eigen::MatrixXd factor;      // columns of the pivoted Cholesky factor of the regressors' correlations
  Eigen::VectorXd variance;    // of each regressor, 1 at the start; 0: constant or taken
  Eigen::MatrixXd covariance;  // with the outputs, regressors x outputs
  Eigen::VectorXd rss;         // of the outputs, 1 at the start
};

// The regressor that lowers the sum of squares most; of equal ones the first. -1: none is left.
Eigen::Index best_of(const Remaining& remaining) {
  Eigen::Index best = -1;
  double most = 0.0;
  for (Eigen::Index k = 0; k < remaining.variance.size(); ++k) {
    if (remaining.variance(k) > least_new_variance) {
      const double gain = remaining.covariance.row(k).squaredNorm() / remaining.variance(k);
      if (gain > most * (1.0 + tie_tolerance)) {
        best = k;
        most = gain;
      }
    }
  }
  return best;
}

void take(Eigen::Index k, const Eigen::MatrixXd& correlation, Eigen::Index step, Remaining& remaining) {
  const double root = std::sqrt(remaining.variance(k));
  auto column = remaining.factor.col(step);
  column =
      (correlation.col(k) - remaining.factor.leftCols(step) * remaining.factor.row(k).head(step).transpose()) / root;
  const Eigen::RowVectorXd projection = remaining.covariance.row(k) / root;
  remaining.rss -= projection.cwiseAbs2().transpose();
  remaining.covariance -= column * projection;
  remaining.variance -= column.cwiseAbs2();
  remaining.variance(k) = 0.0;
}

double aicc(const Eigen::VectorXd& rss, double rows, double coefficients) {
  const double k = coefficients + 1.0;
  const double penalty = 2.0 * k + 2.0 * k * (k + 1.0) / (rows - k - 1.0);
  return (rows * rss.array().max(rounding_of_squares).log() + penalty).sum();
}

// Regressors and outputs about their means, each of length 1.
struct Standardised {
  Eigen::MatrixXd correlation;  // of the regressors
  Eigen::ArrayXd total;         // of the outputs, sums of squares about their means
  Remaining remaining;          // before the first regressor is taken
};

Standardised standardised(const LocalSums& sums) {
  const Eigen::Index regressors = sums.gram.rows() - 1;
  const double weight = sums.gram(0, 0);
  const Eigen::VectorXd mean = sums.gram.col(0).tail(regressors) / weight;
  const Eigen::RowVectorXd mean_output = sums.products.row(0) / weight;
  Eigen::MatrixXd correlation = sums.gram.bottomRightCorner(regressors, regressors) - weight * mean * mean.transpose();
  // A column that is constant here has no variance; what the subtraction of its mean leaves is rounding.
  const Eigen::ArrayXd scale =
      (correlation.diagonal().array() > rounding_of_squares * sums.gram.diagonal().tail(regressors).array())
          .select(correlation.diagonal().array().max(0.0).sqrt(), 0.0);
  const Eigen::ArrayXd inverse = (scale > 0.0).select(scale.inverse(), 0.0);
  correlation = inverse.matrix().asDiagonal() * correlation * inverse.matrix().asDiagonal();
  const Eigen::ArrayXd total = (sums.squares.array() - weight * mean_output.transpose().array().square()).max(0.0);
  const Eigen::ArrayXd per_output =
      (total > rounding_of_squares * sums.squares.array()).select(total.sqrt().inverse(), 0.0);
  Remaining remaining{.factor = Eigen::MatrixXd::Zero(regressors, regressors),
                      .variance = (scale > 0.0).select(Eigen::ArrayXd::Ones(regressors), 0.0),
                      .covariance = inverse.matrix().asDiagonal() *
                                    (sums.products.bottomRows(regressors) - weight * mean * mean_output) *
                                    per_output.matrix().asDiagonal(),
                      .rss = (per_output > 0.0).select(Eigen::ArrayXd::Ones(per_output.size()), 0.0)};
  return {std::move(correlation), total, std::move(remaining)};
}

}  // namespace

std::vector<Eigen::Index> select_regressors(const LocalSums& sums, double rows_per_weight) {
  const double weight = sums.gram(0, 0);
  const double rows = rows_per_weight * weight;
  std::vector<Eigen::Index> chosen = {0};
  if (!(weight > 0.0)) return chosen;
  auto [correlation, total, remaining] = standardised(sums);
  std::vector<Eigen::Index> order;
  std::size_t best = 0;
  double smallest = aicc(remaining.rss, rows, 1.0);
  // The next model has the constant, the chosen regressors and one more.
  const auto enough_rows = [&] { return rows - static_cast<double>(order.size()) > 2.0 + least_spare_rows; };
  while (order.size() < best + regressors_without_gain && enough_rows() &&
         remaining.rss.maxCoeff() > rounding_of_squares) {
    const Eigen::Index next = best_of(remaining);
    if (next < 0) break;
    take(next, correlation, std::ssize(order), remaining);
    order.push_back(next);
    const double criterion = aicc(remaining.rss, rows, 1.0 + static_cast<double>(order.size()));
    if (criterion < smallest) {
      smallest = criterion;
      best = order.size();
    }
  }
  for (std::size_t i = 0; i < best; ++i) {
    chosen.push_back(order[i] + 1);
  }
  std::ranges::sort(chosen);
  return chosen;
}

SelectionPath selection_path(const LocalSums& sums, Eigen::Index most, const std::vector<Parents>& parents) {
  SelectionPath path;
  auto [correlation, total, remaining] = standardised(sums);
  std::vector<Eigen::VectorXd> rss = {total.matrix().cwiseProduct(remaining.rss)};
  std::vector<bool> taken(remaining.variance.size(), false);
  // The first parent of a regressor that is not in yet; itself if all are.
  const auto first_missing = [&](Eigen::Index k) {
    if (!parents.empty()) {
      for (const Eigen::Index parent : parents[k]) {
        if (parent >= 0 && !taken[parent]) return parent;
      }
    }
    return k;
  };
  while (std::ssize(path.regressors) < most && remaining.rss.maxCoeff() > rounding_of_squares) {
    const Eigen::Index best = best_of(remaining);
    if (best < 0) break;
    const Eigen::Index next = first_missing(best);
    if (next != best && !(remaining.variance(next) > least_new_variance)) {
      remaining.variance(best) = 0.0;
      continue;
    }
    take(next, correlation, std::ssize(path.regressors), remaining);
    taken[next] = true;
    path.regressors.push_back(next);
    rss.emplace_back(total.matrix().cwiseProduct(remaining.rss.cwiseMax(0.0)));
  }
  path.rss.resize(total.size(), std::ssize(rss));
  for (std::size_t k = 0; k < rss.size(); ++k) path.rss.col(k) = rss[k];
  return path;
}

}  // namespace llmt
