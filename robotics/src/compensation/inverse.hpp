// One target: damped Newton steps on any forward model whose Jacobian is nearly that of a rigid chain.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "kinematics/mimics.hpp"
#include "llmt/robotics/kinematics.hpp"

namespace llmt::robotics {

struct Goal {
  Eigen::Vector3d position_mm;
  std::optional<Eigen::Matrix3d> rotation;
};

/// What is missing: position in mm, rotation vector in rad times `lever` mm. 3 or 6 numbers.
Eigen::VectorXd missing(const Goal& goal, const Pose& pose, double lever_mm);

class Inverse {
 public:
  using Forward = std::function<Pose(const Eigen::VectorXd&)>;

  struct Solution {
    Eigen::VectorXd q;
    double error_mm = 0.0;  ///< norm of missing()
    bool converged = false;
  };

  Inverse(const Chain& chain, double tolerance_mm, int max_iterations);

  /// From `start`, which is first brought within the limits.
  Solution solve(const Goal& goal, const Eigen::VectorXd& start, const Forward& forward) const;

  Eigen::VectorXd within_limits(const Eigen::VectorXd& q) const;

  /// Of the joints that stand at a limit.
  std::vector<std::size_t> at_limits(const Eigen::VectorXd& q) const;

  /// The same with one joint kept at a value.
  Inverse holding(Eigen::Index joint, double value) const;

  /// Sign of the determinant of the square Jacobian; 0 for other shapes.
  int branch(const Eigen::VectorXd& q, bool with_rotation) const;

  double lever_mm() const { return lever_mm_; }
  const Kinematics& rigid() const { return rigid_; }
  const Eigen::VectorXd& low() const { return low_; }
  const Eigen::VectorXd& high() const { return high_; }

 private:
  Kinematics rigid_;
  std::vector<Follower> followers_;
  std::vector<Eigen::Index> drives_;  // joints that follow no other
  double tolerance_mm_;
  int max_iterations_;
  double lever_mm_;        // the arm's reach: turns angles into lengths
  Eigen::VectorXd scale_;  // of each joint: 1 rad, or the lever for a prismatic one
  Eigen::VectorXd low_;
  Eigen::VectorXd high_;

  Eigen::MatrixXd scaled_jacobian(const Eigen::VectorXd& q, bool with_rotation) const;
  Eigen::VectorXd step(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& error, const Eigen::VectorXd& back,
                       double damping) const;
  Eigen::VectorXd limited_step(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& error, const Eigen::VectorXd& q,
                               const Eigen::VectorXd& start, double damping) const;
};

}  // namespace llmt::robotics
