#include "boosted/linear_start.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

namespace llmt {
namespace {

Eigen::VectorXd column_of(const BinnedFeature& feature) {
  return Eigen::Map<const Eigen::VectorXf>(feature.values.data(), std::ssize(feature.values)).cast<double>();
}

// With A = sqrt(W) Z = U D V', Z and y centred, the leverage of one of the w equal rows behind row i is
// H_i = (sum of U_ik^2 D_k^2 / (D_k^2 + p)) / w_i + 1 / sum(w), and its leave-one-out residual e_i / (1 - H_i).
Eigen::VectorXd ridge_slopes(const Eigen::MatrixXd& z, const Eigen::VectorXd& y, const Eigen::VectorXd& weights) {
  const Eigen::ArrayXd roots = weights.array().sqrt();
  const Eigen::VectorXd scaled = (y.array() * roots).matrix();
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(z.array().colwise() * roots, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::MatrixXd& u = svd.matrixU();
  const Eigen::ArrayXd squares = svd.singularValues().array().square();
  const Eigen::VectorXd along = u.transpose() * scaled;
  const double weight = weights.sum();
  Eigen::VectorXd slopes = Eigen::VectorXd::Zero(z.cols());
  double best = std::numeric_limits<double>::infinity();
  for (int step = -10; step <= 4; ++step) {
    const double penalty = weight * std::pow(10.0, 0.5 * step);
    const Eigen::ArrayXd kept = squares / (squares + penalty);
    const Eigen::ArrayXd left = scaled.array() - (u * (kept * along.array()).matrix()).array();
    const Eigen::ArrayXd leverages =
        (u.array().square().matrix() * kept.matrix()).array() / weights.array() + 1.0 / weight;
    constexpr double least = 1e-6;  // a row that the fit goes through has no residual to speak of
    const double error = (left / (1.0 - leverages).max(least)).square().sum();
    if (error >= best) continue;
    best = error;
    slopes = svd.matrixV() * (svd.singularValues().array() / (squares + penalty) * along.array()).matrix();
  }
  return slopes;
}

}  // namespace

std::vector<BoostedLeaf> linear_start(const BinnedRows& rows, const Eigen::VectorXd& output,
                                      const std::vector<int>& train) {
  const Eigen::VectorXd weights = rows.weights(train);
  const auto centred = [&](const Eigen::VectorXd& values) -> Eigen::VectorXd {
    return values.array() - values.dot(weights) / weights.sum();
  };
  Eigen::MatrixXd z(std::ssize(train), std::ssize(rows.features));
  std::vector<BoostedLeaf> leaves;
  for (Eigen::Index j = 0; j < z.cols(); ++j) z.col(j) = centred(column_of(rows.features[j])(train));
  const Eigen::VectorXd slopes = ridge_slopes(z, centred(output(train)), weights);
  for (Eigen::Index j = 0; j < z.cols(); ++j) {
    if (slopes(j) == 0.0) continue;
    const Eigen::VectorXd values = slopes(j) * column_of(rows.features[j])(train);
    const double margin = 0.1 * (values.maxCoeff() - values.minCoeff());
    leaves.push_back({.constant = 0.0,
                      .low = values.minCoeff() - margin,
                      .high = values.maxCoeff() + margin,
                      .features = {static_cast<int>(j)},
                      .slopes = {slopes(j)}});
  }
  return leaves;
}

Eigen::VectorXd values_of(const std::vector<BoostedLeaf>& slopes, const BinnedRows& rows) {
  Eigen::VectorXd values = Eigen::VectorXd::Zero(rows.weights.size());
  for (const BoostedLeaf& leaf : slopes) {
    const Eigen::ArrayXd of_leaf = leaf.slopes.front() * column_of(rows.features[leaf.features.front()]).array();
    values.array() += of_leaf.max(leaf.low).min(leaf.high);
  }
  return values;
}

}  // namespace llmt
