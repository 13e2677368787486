#include "check/movements.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "check/f_tail.hpp"

namespace llmt::robotics {
namespace {

// L with L L' the covariance.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

// Normal equations of all columns of J after the errors of the calibration, which are unknowns with a unit prior, are
// eliminated: by Woodbury, the inverse of 1 + U U' applied to J and to the residuals. In units of the noise.
struct Normal {
  Eigen::MatrixXd matrix;  // K x K
  Eigen::VectorXd right;   // K
};

Normal normal_of(const MovementProblem& problem, double noise) {
  const Eigen::MatrixXd columns = problem.jacobian / noise;
  const Eigen::VectorXd residuals = problem.residuals / noise;
  const Eigen::MatrixXd gram = columns.transpose() * columns;
  const Eigen::VectorXd right = columns.transpose() * residuals;
  const Eigen::MatrixXd root = root_of(problem.covariance);
  Eigen::MatrixXd inner = root.transpose() * gram * root;
  inner.diagonal().array() += 1.0;
  const Eigen::LLT<Eigen::MatrixXd> factor(inner);
  const Eigen::MatrixXd gram_root = gram * root;
  return {gram - gram_root * factor.solve(gram_root.transpose()),
          right - gram_root * factor.solve(root.transpose() * right)};
}

// The chi square that the columns in `tested` take, with those in `fitted` fitted, and their estimates.
struct Gain {
  double chi_square = 0.0;
  Eigen::Index freedom = 0;
};

Eigen::MatrixXd solved(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
  decomposition.setThreshold(1e-10);
  decomposition.compute(matrix);
  return decomposition.solve(right);
}

Gain gain_of(const Normal& normal, const std::vector<Eigen::Index>& fitted, const std::vector<Eigen::Index>& tested) {
  Eigen::MatrixXd own = normal.matrix(tested, tested);
  Eigen::VectorXd right = normal.right(tested);
  const Eigen::VectorXd size = own.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  if (!fitted.empty()) {
    const Eigen::MatrixXd cross = normal.matrix(fitted, tested);
    const Eigen::MatrixXd taken = solved(normal.matrix(fitted, fitted), cross);
    own -= cross.transpose() * taken;
    right -= taken.transpose() * normal.right(fitted);
  }
  // The rest of a column, as a share of it, must be more than rounding.
  own = (size.asDiagonal() * own * size.asDiagonal()).eval();
  right = size.cwiseProduct(right).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(own);
  constexpr double least_share = 1e-6;
  Gain gain;
  for (Eigen::Index k = 0; k < own.rows(); ++k) {
    const double value = solver.eigenvalues()(k);
    if (value < least_share) continue;
    gain.chi_square += std::pow(solver.eigenvectors().col(k).dot(right), 2) / value;
    ++gain.freedom;
  }
  return gain;
}

bool contains(const std::vector<Eigen::Index>& all, const std::vector<Eigen::Index>& some) {
  return std::ranges::all_of(some, [&](Eigen::Index column) { return std::ranges::count(all, column) > 0; });
}

// Estimates of all that moved, fitted together.
void estimate(const MovementProblem& problem, const Normal& normal, Movements& result) {
  std::vector<Eigen::Index> fitted = problem.nuisance;
  for (const Movement& movement : result.found) {
    for (const Eigen::Index column : problem.suspects[movement.suspect].columns) {
      if (std::ranges::count(fitted, column) == 0) fitted.push_back(column);
    }
  }
  result.left = problem.residuals;
  if (fitted.empty()) return;
  const Eigen::MatrixXd inverse =
      solved(normal.matrix(fitted, fitted), Eigen::MatrixXd::Identity(std::ssize(fitted), std::ssize(fitted)));
  const Eigen::VectorXd values = inverse * normal.right(fitted);
  for (Movement& movement : result.found) {
    for (const Eigen::Index column : problem.suspects[movement.suspect].columns) {
      const auto at = std::ranges::find(fitted, column) - fitted.begin();
      movement.changes.push_back(values(at));
      movement.standard_errors.push_back(std::sqrt(std::max(0.0, inverse(at, at))));
    }
  }
  // A new calibration would find them like this: by the new measurements alone.
  const Eigen::MatrixXd columns = problem.jacobian(Eigen::all, fitted);
  result.left -= columns * solved(columns, problem.residuals);
}

}  // namespace

Unexplained unexplained(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals) {
  Eigen::MatrixXd columns = jacobian;
  for (auto column : columns.colwise()) column.stableNormalize();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(columns);
  factors.setThreshold(1e-7);
  const Eigen::VectorXd rotated = factors.householderQ().adjoint() * residuals;
  const Eigen::Index freedom = rotated.size() - factors.rank();
  Unexplained result{.noise = 0.0, .freedom = static_cast<double>(freedom)};
  if (freedom > 0) result.noise = rotated.tail(freedom).norm() / std::sqrt(result.freedom);
  return result;
}

Movements find_movements(const MovementProblem& problem) {
  Movements result;
  const auto [noise, freedom_behind] = unexplained(problem.jacobian, problem.residuals);
  result.left = problem.residuals;
  if (!(freedom_behind > 0.0)) return result;
  // Exact data: the rounding of positions of metres, mm.
  constexpr double rounding = 1e-9;
  const Normal normal = normal_of(problem, std::max({rounding, problem.least_noise, noise}));
  std::vector<Eigen::Index> fitted = problem.nuisance;
  const auto count = static_cast<double>(problem.residuals.size());
  std::vector<std::size_t> left;
  for (std::size_t k = 0; k < problem.suspects.size(); ++k) {
    (gain_of(normal, fitted, problem.suspects[k].columns).freedom > 0 ? left : result.unseen).push_back(k);
  }
  const auto tests = static_cast<double>(left.size());
  for (double done = 0.0; done < tests; ++done) {
    std::vector<Gain> gains;
    Movement best;
    double best_score = 0.0;
    bool is_found = false;
    Gain best_gain;
    for (const std::size_t k : left) {
      const Gain gain = gain_of(normal, fitted, problem.suspects[k].columns);
      gains.push_back(gain);
      if (gain.freedom == 0) continue;
      const auto freedom = static_cast<double>(gain.freedom);
      const double probability = (tests - done) * f_tail(gain.chi_square / freedom, freedom, freedom_behind);
      const double score = gain.chi_square - freedom * std::log(count);
      if (probability < problem.level && (!is_found || score > best_score)) {
        is_found = true;
        best_score = score;
        best_gain = gain;
        best = {.suspect = k, .changes = {}, .standard_errors = {}, .probability = probability, .or_else = {}};
      }
    }
    if (!is_found) break;
    constexpr double alike = 3.84;
    const std::vector<Eigen::Index>& columns = problem.suspects[best.suspect].columns;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const bool is_another = left[i] != best.suspect && !contains(problem.suspects[left[i]].columns, columns);
      if (is_another && gains[i].chi_square > best_gain.chi_square - alike) best.or_else.push_back(left[i]);
    }
    fitted.insert(fitted.end(), columns.begin(), columns.end());
    std::erase(left, best.suspect);
    result.found.push_back(std::move(best));
  }
  estimate(problem, normal, result);
  return result;
}

}  // namespace llmt::robotics
