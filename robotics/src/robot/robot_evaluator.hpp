// A robot prepared for evaluation over one set of poses. Nothing is allocated per pose.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "effects/effect_entries.hpp"
#include "llmt/robotics/kinematics.hpp"
#include "llmt/robotics/robot_types.hpp"
#include "robot/chart.hpp"

namespace llmt::robotics {

/// An effect whose place, columns and sizes have been looked up.
struct PreparedEffect {
  const EffectType* type;
  std::size_t index;
  ApplyFunction apply;
  std::vector<double> values;
  std::vector<double> constants;
  std::vector<double> scales;                   // of each value
  std::vector<const Eigen::VectorXd*> columns;  // of the poses
};

/// Finds what an effect needs. Throws std::invalid_argument if a column is missing.
PreparedEffect prepare(const Chain& chain, const Effect& effect, const Poses& poses);

/// The column of that name, or of the first name of "a|b" that is there; null if there is none.
const Eigen::VectorXd* find_column(const Poses& poses, const std::string& names);

/// Evaluates row after row with the chain's own base and tool; holds the memory it works in, so each thread needs its
/// own. Robot and poses must outlive it.
class RobotEvaluator {
 public:
  RobotEvaluator(const Robot& robot, const Poses& poses);

  const Robot& robot() const { return robot_; }
  const Poses& poses() const { return poses_; }

  /// What is read of the tool.
  Eigen::Vector3d reading(Eigen::Index row) { return reading_of(pose(row), observation(row)); }

  /// Of the tool.
  Pose pose(Eigen::Index row);

  /// Of the reading, 3 x parameters(robot).
  Eigen::Matrix3Xd jacobian(Eigen::Index row);

  /// J: z_j . load, N m or N.
  Eigen::VectorXd gravity_loads(Eigen::Index row);

  /// Of the reading by the joint values of the rigid arm, 3 x J.
  Eigen::Matrix3Xd joint_motion(Eigen::Index row);

  /// Of each candidate in turn, derivatives of the reading by its values at 0, on top of the robot: the columns
  /// of `out`, 3 x sum of value counts.
  void signatures(Eigen::Index row, std::vector<PreparedEffect>& candidates, Eigen::Ref<Eigen::Matrix3Xd> out);

 private:
  // First-order displacement of the tool by small changes of the deformed arm: levers about which they turn it. Of an
  // orientation only how they turn it.
  struct Levers {
    bool turns_only = false;
    Eigen::Vector3d base;
    std::vector<Eigen::Vector3d> joint;  // per unit of the joint value
    std::vector<Eigen::Vector3d> link;
  };

  const Robot& robot_;
  const Poses& poses_;
  Kinematics kinematics_;
  std::vector<PreparedEffect> effects_;
  const Eigen::VectorXd* payload_ = nullptr;
  bool bears_loads_ = false;

  Eigen::VectorXd q_;
  Skeleton rigid_;
  Skeleton deformed_;
  std::vector<Load> loads_;
  std::vector<double> columns_;
  Deformation deformation_;
  Deformation trial_;
  Levers levers_;

  const Observation* observation(Eigen::Index row) const {
    return poses_.observations.empty() ? nullptr : &poses_.observations[row];
  }
  bool is_orientation(Eigen::Index row) const {
    return observation(row) != nullptr && observation(row)->reading == Reading::orientation;
  }
  void chart(Eigen::Index row, Eigen::Ref<Eigen::Matrix3Xd> derivatives) const;
  PoseContext context(Eigen::Index row);
  void adjust(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect);
  void sum_loads(const PoseContext& pose);
  void apply(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect, Deformation& sum);
  void deform(PoseContext& pose, Eigen::Index row, const PreparedEffect* extra, Deformation& sum);
  void set_levers(Eigen::Index row);
  Eigen::Vector3d displacement(const Deformation& change) const;
  Eigen::Vector3d moved_by(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect);
  void derivatives(PoseContext& pose, Eigen::Index row, PreparedEffect& effect, Eigen::Ref<Eigen::Matrix3Xd> out);
  void whole_derivatives(Eigen::Index row, PreparedEffect& effect, bool is_candidate, Eigen::Ref<Eigen::Matrix3Xd> out);
};

}  // namespace llmt::robotics
