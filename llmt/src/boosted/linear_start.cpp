#include "boosted/linear_start.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "boosted/leaf_model.hpp"
#include "boosted/model/boosted_checks.hpp"

namespace llmt {
namespace {

Eigen::VectorXd column_of(const BinnedFeature& feature) {
  return Eigen::Map<const Eigen::VectorXf>(feature.values.data(), std::ssize(feature.values)).cast<double>();
}

// The eigenvectors of A'A, or, if there are fewer rows than columns, those of them that A does not map to 0.
Eigen::MatrixXd directions_of(const Eigen::MatrixXd& a) {
  using Solver = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
  if (a.cols() <= a.rows()) return Solver(a.transpose() * a).eigenvectors();
  Eigen::MatrixXd directions = a.transpose() * Solver(a * a.transpose()).eigenvectors();
  directions.colwise().normalize();  // leaves a column of zeros
  return directions;
}

// With A = sqrt(W) Z, Z and y centred, V the directions above and T = A V, whose columns are orthogonal with the
// squares D_k^2: the slopes are V (T'T + p I)^-1 T' sqrt(W) y, the leverage of one of the w_i equal rows behind row i
// is H_i = sum of T_ik^2 / (D_k^2 + p) / w_i + 1 / sum(w), and its leave-one-out residual e_i / (1 - H_i).
Eigen::VectorXd ridge_slopes(const Eigen::MatrixXd& z, const Eigen::VectorXd& y, const Eigen::VectorXd& weights) {
  const Eigen::VectorXd roots = weights.cwiseSqrt();
  const Eigen::MatrixXd a = roots.asDiagonal() * z;
  const Eigen::VectorXd scaled = roots.cwiseProduct(y);
  const Eigen::MatrixXd directions = directions_of(a);
  const Eigen::MatrixXd t = a * directions;
  const Eigen::ArrayXd squares = t.colwise().squaredNorm().transpose();
  const Eigen::ArrayXd along = t.transpose() * scaled;
  const double weight = weights.sum();
  Eigen::VectorXd slopes = Eigen::VectorXd::Zero(z.cols());
  double best = std::numeric_limits<double>::infinity();
  for (int step = -10; step <= 4; ++step) {
    const double penalty = weight * std::pow(10.0, 0.5 * step);
    const Eigen::VectorXd inverse = (squares + penalty).inverse();
    const Eigen::VectorXd terms = inverse.array() * along;
    const Eigen::ArrayXd left = scaled - t * terms;
    const Eigen::ArrayXd leverages = (t.cwiseAbs2() * inverse).array() / weights.array() + 1.0 / weight;
    constexpr double least = 1e-6;  // a row that the fit goes through has no residual to speak of
    const double error = (left / (1.0 - leverages).max(least)).square().sum();
    if (error >= best) continue;
    best = error;
    slopes = directions * terms;
  }
  return slopes;
}

}  // namespace

std::vector<BoostedTree> linear_start(const BinnedRows& rows, const Eigen::VectorXd& output,
                                      const std::vector<int>& train) {
  const Eigen::VectorXd weights = rows.weights(train);
  const auto centred = [&](const Eigen::VectorXd& values) -> Eigen::VectorXd {
    return values.array() - values.dot(weights) / weights.sum();
  };
  Eigen::MatrixXd z(std::ssize(train), std::ssize(rows.features));
  std::vector<BoostedTree> trees;
  for (Eigen::Index j = 0; j < z.cols(); ++j) z.col(j) = centred(column_of(rows.features[j])(train));
  const Eigen::VectorXd slopes = ridge_slopes(z, centred(output(train)), weights);
  for (Eigen::Index j = 0; j < z.cols(); ++j) {
    if (slopes(j) == 0.0) continue;
    const Eigen::VectorXd values = slopes(j) * column_of(rows.features[j])(train);
    const double margin = 0.1 * (values.maxCoeff() - values.minCoeff());
    BoostedLeaf leaf{.constant = 0.0, .low = values.minCoeff() - margin, .high = values.maxCoeff() + margin};
    leaf.features.push_back(static_cast<int>(j));
    leaf.slopes.push_back(slopes(j));
    const BinnedFeature& feature = rows.features[j];
    const auto is_lacking = [&](int row) { return feature.cells[row] == missing_cell; };
    const double mean = column_of(feature)(train).dot(weights) / weights.sum();
    leaf.means.push_back(std::ranges::any_of(train, is_lacking) ? 0.0 : rounded_stand_in(mean));
    trees.push_back({.splits = {}, .leaves = {leaf}});
  }
  return trees;
}

Eigen::VectorXd values_of(const std::vector<BoostedTree>& trees, const BinnedRows& rows) {
  Eigen::VectorXd values = Eigen::VectorXd::Zero(rows.weights.size());
  std::vector<double> z(rows.features.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    for (std::size_t j = 0; j < z.size(); ++j) z[j] = rows.features[j].value(i);
    for (const BoostedTree& tree : trees) values(i) += value_of(tree, z.data());
  }
  return values;
}

}  // namespace llmt
