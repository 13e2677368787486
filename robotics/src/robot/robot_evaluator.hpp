// A robot prepared for evaluation over one set of poses. Nothing is allocated per pose.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "effects/effect_entries.hpp"
#include "llmt/robotics/kinematics.hpp"
#include "llmt/robotics/robot_types.hpp"
#include "robot/arm_change.hpp"
#include "robot/chart.hpp"
#include "robot/settings.hpp"

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
  std::vector<std::size_t> inputs;              // of RobotEvaluator's that it depends on
  std::vector<Eigen::Index> components;         // of the deformation that it may change, ascending
};

/// Finds what an effect needs. Throws std::invalid_argument if a column is missing.
PreparedEffect prepare(const Chain& chain, const Effect& effect, const Poses& poses);

/// The column of that name, or of the first name of "a|b" that is there; null if there is none.
const Eigen::VectorXd* find_column(const Poses& poses, const std::string& names);

/// Evaluates row after row with the chain's own base and tool; holds the memory it works in, so each thread needs its
/// own. Robot and poses, or the setting, must outlive it.
class RobotEvaluator {
 public:
  explicit RobotEvaluator(const Setting& setting);
  RobotEvaluator(const Robot& robot, const Poses& poses);
  RobotEvaluator(const RobotEvaluator&) = delete;  // points into itself
  RobotEvaluator& operator=(const RobotEvaluator&) = delete;

  const Robot& robot() const { return robot_; }
  const Poses& poses() const { return poses_; }

  /// What is read of the tool.
  Eigen::Vector3d reading(Eigen::Index row) {
    return reading_of(pose(row), observation(row)) - radius_mm_ * Eigen::Vector3d::UnitX();
  }

  /// Of the tool.
  Pose pose(Eigen::Index row);

  /// Of the reading by the parameters(robot) with these numbers: the columns of `out`, in that order.
  void jacobian(Eigen::Index row, const std::vector<Eigen::Index>& parameters, Eigen::Ref<Eigen::Matrix3Xd> out);

  /// J: z_j . load, N m or N.
  Eigen::VectorXd gravity_loads(Eigen::Index row);

  /// Of the reading by the joint values of the rigid arm, 3 x J.
  Eigen::Matrix3Xd joint_motion(Eigen::Index row);

  /// Of each candidate in turn, derivatives of the reading by its values at 0, on top of the robot: the columns
  /// of `out`, 3 x sum of value counts.
  void signatures(Eigen::Index row, std::vector<PreparedEffect>& candidates, Eigen::Ref<Eigen::Matrix3Xd> out);

 private:
  const Robot& robot_;
  const Poses& poses_;
  Kinematics kinematics_;
  std::vector<PreparedEffect> effects_;
  const Eigen::VectorXd* payload_ = nullptr;
  bool is_touched_ = false;  // what is read of, see Setting
  double radius_mm_ = 0.0;   // see Setting
  bool bears_loads_ = false;
  std::vector<Input> inputs_;                 // that some effect depends on
  std::vector<Eigen::Index> own_components_;  // of the deformation, that some effect may change

  Eigen::VectorXd q_;
  Skeleton arm_;        // where the loads act
  Deformation before_;  // of it
  Deformation deformation_;
  std::vector<Load> loads_;
  std::vector<double> columns_;

  // For derivatives. A deformation is a vector of components there.
  Deformation trial_;                      // by one effect; all zero between two of them
  std::vector<double*> trial_components_;  // all of trial_
  Pose tool_;                              // of the deformed arm
  Eigen::Vector3d arm_tool_mm_;            // without Deformation::world_mm
  std::vector<Motion> motions_;            // of arm_, by the geometric parameters, where they differ from the next
  std::vector<Motion> deformed_motions_;   // of the deformed arm
  WeightsBeyond weights_;
  std::vector<Eigen::Index> components_;    // that rows and columns stand for, own_components_ or all
  std::vector<Eigen::Index> place_;         // of each component among them, or -1
  Eigen::MatrixXd by_input_;                // components x 3 inputs: of the deformation
  std::vector<std::size_t> live_;           // inputs that do something in this pose
  Eigen::Matrix3Xd direct_;                 // 3 x components: of the reading, the rest of the deformation held
  Eigen::Matrix3Xd levers_;                 // 3 x components: of the reading, in equilibrium
  Eigen::Matrix3Xd input_levers_;           // 3 x 3 inputs: of the reading, in equilibrium
  Eigen::MatrixXd responses_;               // components x components: of the deformation, by itself
  Eigen::MatrixX3d sides_;                  // components x 3: of the deformation by an effect, for differences
  std::vector<Eigen::Matrix3d> held_back_;  // of the reading, by a turn of the arm from that twist on that leaves
                                            // the twists where they point in the world; empty without twists
  std::vector<double> given_;               // values of an effect
  Eigen::Matrix3Xd by_effects_;             // 3 x values of all effects: of the reading

  const Observation* observation(Eigen::Index row) const {
    return poses_.observations.empty() ? nullptr : &poses_.observations[row];
  }
  bool is_orientation(Eigen::Index row) const {
    return observation(row) != nullptr && observation(row)->reading == Reading::orientation;
  }
  void chart(Eigen::Index row, Eigen::Ref<Eigen::Matrix3Xd> derivatives) const;
  PoseContext context(Eigen::Index row);
  void adjust(PoseContext& pose, Eigen::Index row, const PreparedEffect* extra = nullptr);
  void sum_loads(const PoseContext& pose);
  void apply(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect, Deformation& sum);
  PoseContext deform(Eigen::Index row);
  PoseContext settle(Eigen::Index row);

  // robot_levers.cpp: how the reading follows the deformation.
  void set_levers(PoseContext& pose, Eigen::Index row);
  void extend_levers(const PoseContext& pose, Eigen::Index row);
  Eigen::Vector3d reading_change(const PoseContext& pose, const ArmChange& change) const;
  Eigen::Vector3d by_motion(const PoseContext& pose, Eigen::Index row, const Motion& motion,
                            const Motion* of_loads) const;
  void deformation_by(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect,
                      Eigen::Ref<Eigen::VectorXd> out);
  void choose_components(const std::vector<Eigen::Index>& chosen);
  Motion component_motion(Eigen::Index component, bool of_deformed) const;
  void set_direct_levers(Eigen::Index row);
  void add_input(PoseContext& pose, Eigen::Index row, const PreparedEffect& effect, std::size_t input);
  void set_inputs(PoseContext& pose, Eigen::Index row);
  void set_response(const PoseContext& pose, Eigen::Index component, Eigen::Ref<Eigen::VectorXd> response);
  void settle_levers(const PoseContext& pose);
  void set_held_back();

  // robot_derivatives.cpp: the reading by parameters.
  void by_values(PoseContext& pose, Eigen::Index row, PreparedEffect& effect, Eigen::Ref<Eigen::Matrix3Xd> out);
  void by_adjustments(const PoseContext& pose, Eigen::Index row, PreparedEffect& effect, bool is_candidate,
                      Eigen::Ref<Eigen::Matrix3Xd> out);
  void set_effect_columns(PoseContext& pose, Eigen::Index row);
  void rigid_jacobian(Eigen::Index row, const std::vector<Eigen::Index>& parameters, Eigen::Ref<Eigen::Matrix3Xd> out);
};

}  // namespace llmt::robotics
