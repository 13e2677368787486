#include "mechanism/pose_solver.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace llmt::robotics {
namespace {

constexpr const char* singular = "the equations are singular here";

// The equations linearised at a configuration: G v/sigma + Z dz + ..., and what eliminates dz.
struct LinearPose {
  Eigen::MatrixXd noisy;      // G = df/dv diag(sigma)
  Eigen::MatrixXd null_rows;  // N', redundant x equations
  Eigen::MatrixXd solve;      // of Z dz = ..., unknown x equations
  Eigen::MatrixXd whitened;   // (B B')^(-1/2) N'
  bool is_regular = true;
};

LinearPose linear_pose(const Eigen::MatrixXd& slopes, const PoseKinds& kinds, const Eigen::VectorXd& sigma) {
  constexpr double smallest = 1e-10;
  const Eigen::Index equations = slopes.rows();
  const Eigen::Index unknown = std::ssize(kinds.unknown);
  LinearPose linear;
  linear.noisy = slopes(Eigen::all, kinds.noisy) * sigma(kinds.noisy).asDiagonal();
  linear.null_rows = Eigen::MatrixXd::Identity(equations, equations);
  linear.solve.resize(0, equations);
  if (unknown > 0) {
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(slopes(Eigen::all, kinds.unknown));
    qr.setThreshold(smallest);
    linear.is_regular = qr.rank() == unknown;
    if (!linear.is_regular) return linear;
    linear.null_rows = Eigen::MatrixXd(qr.householderQ()).rightCols(equations - unknown).transpose();
    linear.solve = qr.solve(Eigen::MatrixXd::Identity(equations, equations));
  }
  const Eigen::MatrixXd seen = linear.null_rows * linear.noisy;
  const Eigen::LLT<Eigen::MatrixXd> root(seen * seen.transpose());
  const Eigen::MatrixXd lower = root.matrixL();
  linear.is_regular = seen.rows() == 0 || (root.info() == Eigen::Success &&
                                           lower.diagonal().minCoeff() > smallest * lower.diagonal().maxCoeff());
  if (linear.is_regular && seen.rows() > 0) linear.whitened = root.matrixL().solve(linear.null_rows);
  if (seen.rows() == 0) linear.whitened.resize(0, equations);
  return linear;
}

// Angles turn at most half a radian a step.
double share_of_step(const Eigen::VectorXd& step, const Eigen::VectorXd& typical) {
  constexpr double most = 0.5;
  const double longest = step.size() == 0 ? 0.0 : (step.array() / typical.array()).abs().maxCoeff();
  return longest > most ? most / longest : 1.0;
}

}  // namespace

PoseKinds kinds_of(const Eigen::VectorXd& known, const Eigen::VectorXd& sigma) {
  PoseKinds kinds;
  for (Eigen::Index i = 0; i < known.size(); ++i) {
    if (!std::isfinite(known(i))) {
      kinds.unknown.push_back(i);
    } else if (sigma(i) > 0.0) {
      kinds.noisy.push_back(i);
    }
  }
  return kinds;
}

SolvedPose solve_pose(Equations& equations, const Eigen::VectorXd& parameters, const Eigen::VectorXd& known,
                      const Eigen::VectorXd& sigma, const Eigen::VectorXd& start, int most_steps) {
  constexpr double settled = 1e-11;  // of what is typical
  const PoseKinds kinds = kinds_of(known, sigma);
  const Eigen::VectorXd& typical = equations.typical();
  Eigen::VectorXd at = known;
  at(kinds.unknown) = start(kinds.unknown);
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(std::ssize(kinds.noisy));  // v / sigma
  SolvedPose solved;
  for (int step = 0; step < most_steps; ++step) {
    const Eigen::VectorXd values = equations.values(parameters, at);
    const Eigen::MatrixXd slopes = equations.by_coordinates(parameters, at);
    if (!values.allFinite() || !slopes.allFinite()) {
      solved.failure = "an equation has no value";
      return solved;
    }
    const LinearPose linear = linear_pose(slopes, kinds, sigma);
    if (!linear.is_regular) {
      solved.failure = singular;
      return solved;
    }
    const Eigen::VectorXd left = values - linear.noisy * moved;
    const Eigen::MatrixXd& white = linear.whitened;
    solved.residual = white * left;
    const Eigen::VectorXd next = -(white * linear.noisy).transpose() * solved.residual;
    Eigen::VectorXd change = -linear.solve * (left + linear.noisy * next);
    const double share = share_of_step(change, typical(kinds.unknown));
    change *= share;
    const Eigen::VectorXd adjusted = share * (next - moved).cwiseProduct(sigma(kinds.noisy));
    moved += share * (next - moved);
    at(kinds.unknown) += change;
    at(kinds.noisy) = known(kinds.noisy) + moved.cwiseProduct(sigma(kinds.noisy));
    const auto largest = [&](const Eigen::VectorXd& some, const std::vector<Eigen::Index>& of) {
      return of.empty() ? 0.0 : (some.array() / typical(of).array()).abs().maxCoeff();
    };
    if (std::max(largest(change, kinds.unknown), largest(adjusted, kinds.noisy)) > settled) continue;
    solved.coordinates = at;
    solved.projection = white;
    const std::vector<Eigen::Index>& unknown = kinds.unknown;
    // Where c moves, v moves by -S (W G)' W df, and the unknown follow both.
    const Eigen::MatrixXd seen = white * linear.noisy;
    solved.unknown_rate = -linear.solve * (slopes - linear.noisy * (seen.transpose() * (white * slopes)));
    for (const Eigen::Index i : unknown) solved.unknown_rate.col(i).setZero();
    return solved;
  }
  solved.failure = "the equations have no solution here";
  return solved;
}

SolvedPose nearest_configuration(Equations& equations, const Eigen::VectorXd& parameters,
                                 const Eigen::VectorXd& start) {
  return solve_pose(equations, parameters, start, equations.typical(), start);
}

SolvedPose follow(Equations& equations, const Eigen::VectorXd& parameters, const Eigen::VectorXd& from,
                  const Eigen::VectorXd& known, const Eigen::VectorXd& sigma) {
  constexpr double smallest_step = 1.0 / 4096.0;
  constexpr double most_deviation = 0.3;  // from the tangent, as a share of the step
  constexpr double always_near = 1e-3;    // of what is typical
  constexpr int most_steps = 20;          // of Newton's method from the tangent: a good prediction needs few
  const PoseKinds kinds = kinds_of(known, sigma);
  const Eigen::VectorXd& typical = equations.typical();
  const auto between = [&](double t) -> Eigen::VectorXd { return t >= 1.0 ? known : from + t * (known - from); };
  SolvedPose here = solve_pose(equations, parameters, between(0.0), sigma, from);
  double t = 0.0;
  double step = 1.0;
  while (here.ok() && t < 1.0) {
    const double to = std::min(1.0, t + step);
    Eigen::VectorXd target = between(to);
    Eigen::VectorXd predicted = here.coordinates;
    Eigen::VectorXd driven = target - here.coordinates;
    driven(kinds.unknown).setZero();
    predicted(kinds.unknown) += here.unknown_rate * driven;
    SolvedPose next = solve_pose(equations, parameters, target, sigma, predicted, most_steps);
    const auto size = [&](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
      return ((a - b)(kinds.unknown).array() / typical(kinds.unknown).array()).matrix().norm();
    };
    const bool is_near = next.ok() && size(next.coordinates, predicted) <=
                                          always_near + most_deviation * size(predicted, here.coordinates);
    if (is_near) {
      here = std::move(next);
      t = to;
      step *= 2.0;
    } else {
      step *= 0.5;
    }
    if (step < smallest_step) {
      here.failure = next.ok() ? "it lies behind a singular configuration" : next.failure;
    }
  }
  return here;
}

}  // namespace llmt::robotics
