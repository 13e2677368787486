#include "compensation/inverse.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "kinematics/units.hpp"
#include "linear_algebra/linear_algebra.hpp"

namespace llmt::robotics {
namespace {

constexpr double longest_step = 0.2;  // rad, or that share of the lever: keeps the search on its branch

}  // namespace

Eigen::VectorXd missing(const Goal& goal, const Pose& pose, double lever_mm) {
  Eigen::VectorXd error(goal.rotation ? 6 : 3);
  error.head(3) = goal.position_mm - pose.position_mm;
  if (goal.rotation) {
    const Eigen::AngleAxisd turn(*goal.rotation * pose.rotation.transpose());
    error.tail(3) = lever_mm * turn.angle() * turn.axis();
  }
  return error;
}

Inverse::Inverse(const Chain& chain, double tolerance_mm, int max_iterations)
    : rigid_(chain),
      followers_(followers_of(chain)),
      tolerance_mm_(tolerance_mm),
      max_iterations_(max_iterations),
      lever_mm_(std::max(reach_of(chain), 1.0)) {
  const Eigen::Index count = std::ssize(chain.joints);
  scale_ = Eigen::VectorXd::Ones(count);
  low_ = Eigen::VectorXd::Constant(count, -std::numeric_limits<double>::infinity());
  high_ = -low_;
  for (Eigen::Index j = 0; j < count; ++j) {
    const Joint& joint = chain.joints[j];
    if (!joint.mimic) drives_.push_back(j);
    const bool turns = joint.type == JointType::revolute;
    if (!turns) scale_(j) = lever_mm_;
    if (!joint.limits) continue;
    low_(j) = (*joint.limits)[0] * (turns ? radians : 1.0);
    high_(j) = (*joint.limits)[1] * (turns ? radians : 1.0);
  }
  limit_leaders(followers_, low_, high_);
}

Eigen::VectorXd Inverse::within_limits(const Eigen::VectorXd& q) const {
  return followed(followers_, q.cwiseMax(low_).cwiseMin(high_));
}

std::vector<std::size_t> Inverse::at_limits(const Eigen::VectorXd& q) const {
  std::vector<std::size_t> joints;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    if (q(j) <= low_(j) || q(j) >= high_(j)) joints.push_back(j);
  }
  return joints;
}

Inverse Inverse::holding(Eigen::Index joint, double value) const {
  for (const Follower& f : followers_) {
    if (f.joint == joint) return holding(f.leader, (value - f.offset) / f.multiplier);
  }
  Inverse held = *this;
  held.low_(joint) = value;
  held.high_(joint) = value;
  return held;
}

Eigen::MatrixXd Inverse::scaled_jacobian(const Eigen::VectorXd& q, bool with_rotation) const {
  Eigen::MatrixXd jacobian = rigid_.joint_jacobian(q);
  jacobian.bottomRows(3) *= lever_mm_;
  lead(followers_, jacobian);
  jacobian = jacobian * scale_.asDiagonal();
  return with_rotation ? jacobian : Eigen::MatrixXd(jacobian.topRows(3));
}

int Inverse::branch(const Eigen::VectorXd& q, bool with_rotation) const {
  const Eigen::MatrixXd jacobian = scaled_jacobian(q, with_rotation)(Eigen::all, drives_) / lever_mm_;
  if (jacobian.rows() != jacobian.cols()) return 0;
  return jacobian.determinant() < 0.0 ? -1 : 1;
}

// Damped least squares, and in the directions that do not move the tool as far as possible `back`.
Eigen::VectorXd Inverse::step(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& error,
                              const Eigen::VectorXd& back, double damping) const {
  constexpr double tiny = 1e-14;
  const double size = jacobian.squaredNorm();
  if (size == 0.0) return back;
  if (jacobian.cols() <= jacobian.rows()) {
    Eigen::MatrixXd normal = gram(jacobian);
    normal.diagonal().array() += std::max(damping, tiny) * size;
    return solve_symmetric(normal, transposed_product(jacobian, error));
  }
  Eigen::MatrixXd normal = jacobian * jacobian.transpose();
  normal.diagonal().array() += tiny * size;
  const Eigen::VectorXd free = back - transposed_product(jacobian, solve_symmetric(normal, product(jacobian, back)));
  normal.diagonal().array() += damping * size;
  const Eigen::VectorXd change = transposed_product(jacobian, solve_symmetric(normal, error));
  return damping > 0.0 ? change : Eigen::VectorXd(change + free);  // the target comes first
}

// Joints that would leave their range stay where they are, and the others do the work.
Eigen::VectorXd Inverse::limited_step(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& error,
                                      const Eigen::VectorXd& q, const Eigen::VectorXd& start, double damping) const {
  Eigen::MatrixXd free = jacobian;
  Eigen::VectorXd back = (start - q).cwiseQuotient(scale_);
  Eigen::VectorXd change;
  for (Eigen::Index round = 0; round <= q.size(); ++round) {
    change = step(free, error, back, damping);
    const double longest = change.cwiseAbs().maxCoeff();
    if (longest > longest_step) change *= longest_step / longest;
    bool all_inside = true;
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const bool beyond = (q(j) <= low_(j) && change(j) < 0.0) || (q(j) >= high_(j) && change(j) > 0.0);
      if (!beyond) continue;
      free.col(j).setZero();
      back(j) = 0.0;
      change(j) = 0.0;
      all_inside = false;
    }
    if (all_inside) break;
  }
  return change.cwiseProduct(scale_);
}

Inverse::Solution Inverse::solve(const Goal& goal, const Eigen::VectorXd& start, const Forward& forward) const {
  constexpr double most_damping = 1e4;
  Solution best{.q = within_limits(start)};
  Eigen::VectorXd error = missing(goal, forward(best.q), lever_mm_);
  best.error_mm = error.norm();
  const Eigen::VectorXd origin = best.q;
  double damping = 0.0;
  int polish = 1;  // one more step after the tolerance is met: it costs little and gains the last digits
  for (int iteration = 0; iteration < max_iterations_; ++iteration) {
    if (best.error_mm <= tolerance_mm_ && polish-- == 0) break;
    const Eigen::MatrixXd jacobian = scaled_jacobian(best.q, goal.rotation.has_value());
    bool better = false;
    while (!better && damping <= most_damping) {
      const Eigen::VectorXd q = within_limits(best.q + limited_step(jacobian, error, best.q, origin, damping));
      const Eigen::VectorXd left = missing(goal, forward(q), lever_mm_);
      better = left.norm() < best.error_mm;
      if (better) {
        best.q = q;
        error = left;
        best.error_mm = left.norm();
      } else {
        if (best.error_mm <= tolerance_mm_) break;
        damping = std::max(10.0 * damping, 1e-6);
      }
    }
    if (!better) break;
    damping = damping > 1e-6 ? 0.01 * damping : 0.0;
  }
  best.converged = best.error_mm <= tolerance_mm_;
  return best;
}

}  // namespace llmt::robotics
