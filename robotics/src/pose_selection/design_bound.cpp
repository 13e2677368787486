#include "pose_selection/design_bound.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace llmt::robotics {
namespace {

Eigen::MatrixXd weighted_information(const Eigen::MatrixXd& rows, const Eigen::VectorXd& weights) {
  Eigen::VectorXd roots(rows.rows());
  for (Eigen::Index i = 0; i < roots.size(); ++i) roots(i) = std::sqrt(weights(i / 3));
  const Eigen::MatrixXd scaled = roots.asDiagonal() * rows;
  return scaled.transpose() * scaled;
}

void evaluate(const DesignProblem& problem, const Eigen::MatrixXd& rows, Eigen::Index count, IdealDesign& design) {
  const Eigen::LLT<Eigen::MatrixXd> factor(problem.given +
                                           static_cast<double>(count) * weighted_information(rows, design.weights));
  const Eigen::MatrixXd once = factor.solve(problem.use);
  design.variance = once.trace();
  design.sensitivity = factor.solve(once.transpose());
  design.from_given = design.sensitivity.cwiseProduct(problem.given).sum();
}

// True if the bound is within `share` of half a per cent of the variance.
bool is_near(const IdealDesign& design, Eigen::Index count, double largest_sensitivity, double share) {
  return variance_bound(design, count, largest_sensitivity) > (1.0 - 5e-3 * share) * design.variance;
}

// Steps until the bound over these poses is near the variance.
void improve(const DesignProblem& problem, const Eigen::MatrixXd& rows, Eigen::Index count, int most_steps,
             IdealDesign& design) {
  evaluate(problem, rows, count, design);
  for (int step = 0; step < most_steps; ++step) {
    const Eigen::VectorXd slope = sensitivities(design, rows);
    if (is_near(design, count, slope.maxCoeff(), 0.5)) break;
    // With the square root no step makes it worse (Yu 2010, without priors).
    design.weights.array() *= slope.array().sqrt();
    design.weights /= design.weights.sum();
    evaluate(problem, rows, count, design);
  }
}

}  // namespace

std::vector<Eigen::Index> largest(const Eigen::VectorXd& values, Eigen::Index count) {
  std::vector<Eigen::Index> order(values.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, [&](Eigen::Index a, Eigen::Index b) { return values(a) > values(b); });
  order.resize(std::min(count, values.size()));
  return order;
}

Eigen::VectorXd sensitivities(const IdealDesign& design, const Eigen::MatrixXd& rows) {
  const Eigen::VectorXd of_rows = (rows * design.sensitivity).cwiseProduct(rows).rowwise().sum();
  return Eigen::Map<const Eigen::Matrix3Xd>(of_rows.data(), 3, of_rows.size() / 3).colwise().sum().transpose();
}

IdealDesign ideal_design(const DesignProblem& problem, const Eigen::MatrixXd& rows, Eigen::Index count) {
  constexpr int steps_of_all = 15;
  constexpr int steps_of_few = 150;
  constexpr int rounds = 6;
  constexpr Eigen::Index most_kept = 250;
  constexpr Eigen::Index most_added = 30;
  const Eigen::Index poses = rows.rows() / 3;
  IdealDesign design;
  design.weights = Eigen::VectorXd::Constant(poses, 1.0 / static_cast<double>(poses));
  improve(problem, rows, count, steps_of_all, design);
  // Few poses have a weight in the end: the steps are theirs, and those are added that turn out to be missing.
  std::vector<Eigen::Index> kept = largest(design.weights, most_kept);
  design.weights = Eigen::VectorXd(design.weights(kept));
  design.weights /= design.weights.sum();
  for (int round = 0; round < rounds; ++round) {
    improve(problem, rows_of_poses(rows, kept), count, steps_of_few, design);
    const Eigen::VectorXd slope = sensitivities(design, rows);
    if (is_near(design, count, slope.maxCoeff(), 1.0)) break;
    Eigen::VectorXd missing = slope;
    missing(kept).setZero();
    const std::vector<Eigen::Index> added = largest(missing, most_added);
    const double share = 0.2 / static_cast<double>(most_added);
    design.weights.conservativeResize(std::ssize(kept) + std::ssize(added));
    design.weights.tail(std::ssize(added)).setConstant(share);
    design.weights /= design.weights.sum();
    kept.insert(kept.end(), added.begin(), added.end());
  }
  return design;
}

double variance_bound(const IdealDesign& design, Eigen::Index count, double largest_sensitivity) {
  return design.variance * design.variance / (design.from_given + static_cast<double>(count) * largest_sensitivity);
}

}  // namespace llmt::robotics
