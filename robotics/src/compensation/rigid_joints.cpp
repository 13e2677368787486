// A start where a target names no joints.
#include <cmath>
#include <limits>

#include "compensation/inverse.hpp"
#include "llmt/random.hpp"
#include "llmt/robotics/compensation.hpp"

namespace llmt::robotics {
namespace {

constexpr double tolerance_mm = 1e-3;
constexpr double half_turn = 3.14159265358979323846;

struct Range {
  double middle;
  double half;
};

Range range_of(const Inverse& inverse, Eigen::Index joint) {
  const double low = inverse.low()(joint);
  const double high = inverse.high()(joint);
  if (!std::isfinite(low) || !std::isfinite(high)) return {0.0, half_turn};
  return {0.5 * (low + high), std::min(0.5 * (high - low), std::max(half_turn, 1e-9))};
}

Eigen::VectorXd somewhere(const Inverse& inverse, Random& random) {
  Eigen::VectorXd q(inverse.low().size());
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const Range range = range_of(inverse, j);
    const bool slides = std::isfinite(inverse.low()(j)) && inverse.high()(j) - inverse.low()(j) > 20.0;
    const double half = slides ? 0.5 * (inverse.high()(j) - inverse.low()(j)) : range.half;
    q(j) = range.middle + random.uniform(-half, half);
  }
  return q;
}

// The solution nearest to `wanted`, from several starts; what comes nearest to the goal if there is none.
Inverse::Solution by_many_starts(const Inverse& inverse, const Goal& goal, const Eigen::VectorXd& wanted,
                                 const Inverse::Forward& forward) {
  constexpr int starts = 60;
  Random random(1);
  Inverse::Solution best = inverse.solve(goal, wanted, forward);
  double distance = best.converged ? (best.q - wanted).norm() : std::numeric_limits<double>::infinity();
  for (int k = 0; k < starts; ++k) {
    const Inverse::Solution next = inverse.solve(goal, somewhere(inverse, random), forward);
    if (best.converged && !next.converged) continue;
    const double away = next.converged ? (next.q - wanted).norm() : std::numeric_limits<double>::infinity();
    const bool better = next.converged ? away < distance : next.error_mm < best.error_mm;
    if (!better) continue;
    best = next;
    distance = away;
  }
  return best;
}

}  // namespace

Eigen::MatrixXd rigid_joints(const Robot& robot, const Targets& targets, const Progress& progress) {
  Work work(progress);
  const Inverse inverse(robot.chain, tolerance_mm, 100);
  const auto forward = [&](const Eigen::VectorXd& q) { return inverse.rigid().forward(q); };
  const Eigen::Index joints = std::ssize(robot.chain.joints);
  Eigen::VectorXd last(joints);
  for (Eigen::Index j = 0; j < joints; ++j) last(j) = range_of(inverse, j).middle;
  Eigen::MatrixXd result(targets.positions_mm.rows(), joints);
  for (Eigen::Index row = 0; row < result.rows(); ++row) {
    Goal goal{.position_mm = targets.positions_mm.row(row).transpose(), .rotation = std::nullopt};
    if (drive_count(robot.chain) >= 6 && !targets.rotations.empty()) goal.rotation = targets.rotations[row];
    Inverse::Solution solution{.q = last};
    if (row > 0) solution = inverse.solve(goal, last, forward);
    if (!solution.converged) solution = by_many_starts(inverse, goal, last, forward);
    result.row(row) = solution.q.transpose();
    if (solution.converged) last = solution.q;
    work.did(1.0 / static_cast<double>(result.rows()));
  }
  work.finish();
  return result;
}

}  // namespace llmt::robotics
