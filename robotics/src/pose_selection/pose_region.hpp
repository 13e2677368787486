// The poses that an arm may take.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "kinematics/mimics.hpp"
#include "llmt/random.hpp"
#include "llmt/robotics/kinematics.hpp"
#include "llmt/robotics/pose_selection_options.hpp"

namespace llmt::robotics {

/// Joint values in degrees, n x J; a mm of a prismatic joint is the angle that it is seen at from the arm's reach.
Eigen::MatrixXd joint_degrees(const Chain& chain, const Eigen::MatrixXd& joints);

/// All poses within joint limits (revolute joints without limits: +-180 deg) and box.
class PoseRegion {
 public:
  /// Throws std::invalid_argument if a prismatic joint has no limits or the box is empty.
  PoseRegion(const Chain& chain, const std::optional<ToolBox>& box);

  bool contains(const Eigen::VectorXd& joints) const;

  /// n poses: uniform within the limits; those outside of the box are led to a random point of it. Throws
  /// std::runtime_error if that fails 300 times in a row.
  Eigen::MatrixXd random(Eigen::Index count, Random& random) const;

  /// Poses of the region around one: each joint alone moved to both sides, and random moves of all joints.
  void add_neighbours(const Eigen::VectorXd& joints, double step_deg, Random& random,
                      std::vector<Eigen::VectorXd>& poses) const;

 private:
  Kinematics kinematics_;  // in the frame of the base
  std::vector<Follower> followers_;
  std::optional<ToolBox> box_;
  Eigen::VectorXd lower_;  // infinite for joints that follow another
  Eigen::VectorXd upper_;
  Eigen::VectorXd unit_;  // joint values in one degree

  Eigen::VectorXd nearest(const Eigen::VectorXd& joints) const;
  bool lead_into_box(Eigen::VectorXd& joints, const Eigen::Vector3d& target) const;
};

}  // namespace llmt::robotics
