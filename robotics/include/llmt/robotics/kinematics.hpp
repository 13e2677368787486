/// \file
/// Forward kinematics of a chain as a product of elementary transforms, and all first derivatives.
///
///     const Eigen::Vector3d tool_mm = forward(robot.chain, Eigen::VectorXd::Zero(6)).position_mm;
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/robotics/chain.hpp"

namespace llmt::robotics {

/// Position and orientation in the world frame.
struct Pose {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
};

/// Fixed-axis roll, pitch, yaw in rad of R = Rz(yaw) Ry(pitch) Rx(roll), the pitch from -pi/2 to pi/2. Next to a
/// quarter turn of pitch only roll and yaw together are certain, and together they are exact. At a quarter turn yaw is
/// 0.
Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& rotation);

/// What elasticity, gears or heat do to an arm in one pose: small changes on top of the rigid chain. Vectors are in the
/// world frame.
struct Deformation {
  struct Twist {
    Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();  ///< rotation vector
  };
  explicit Deformation(std::size_t joints = 0) : joint(Eigen::VectorXd::Zero(joints)), link(joints) {}

  /// Sets everything to zero without freeing or allocating memory.
  void clear();

  Twist base;                                          ///< at the first joint's origin: everything moves with it
  Eigen::VectorXd joint;                               ///< added to the joint values: rad, or mm for prismatic joints
  std::vector<Twist> link;                             ///< of the far end of each link: everything beyond moves with it
  Eigen::Vector3d world_mm = Eigen::Vector3d::Zero();  ///< added to the tool position
};

/// Points and axes of an arm in one pose, in the world frame, mm. Link i runs from the axis of joint i to that of joint
/// i + 1, the last one to the tool point. Deformation::world_mm is not in it.
struct Skeleton {
  std::vector<Eigen::Vector3d> joint_origin;   ///< a point on each axis: where link i begins
  std::vector<Eigen::Vector3d> joint_axis;     ///< unit vectors, times the joint's sign
  std::vector<Eigen::Vector3d> link_end;       ///< where link i ends
  std::vector<Eigen::Matrix3d> joint_frame;    ///< axes of the side of each joint that stands still; z is the joint's
  std::vector<Eigen::Vector3d> body_centre;    ///< centre of mass of each link
  std::vector<Eigen::Matrix3d> body_rotation;  ///< of each joint's moving frame, in which com_mm is given
  Eigen::Vector3d payload_centre;
  Eigen::Matrix3d base_rotation;  ///< as described: Deformation::base does not turn it, and with it gravity
  Pose tool;
};

/// How a change of one value moves an arm: everything beyond some place turns about an axis or moves along it.
struct Motion {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();   ///< in the world frame, per rad or mm
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on the axis, mm
  bool turns = false;                               ///< else it moves along the axis
  bool turns_base = false;                          ///< Skeleton::base_rotation moves, too
  std::size_t first_joint = 0;                      ///< origins, axes and frames of the joints from this one on move
  std::size_t first_body = 0;                       ///< centres of mass of the links from this one on move
  std::size_t first_twist = 0;  ///< of Deformation, base = 0, link i = i + 1: from this one on they lie beyond

  /// mm per rad or mm, of a point that moves.
  Eigen::Vector3d of(const Eigen::Vector3d& moving) const;
  /// rad per rad or mm.
  Eigen::Vector3d turn() const;
};

/// The chain with its own base and tool compiled into elementary transforms. Joint values q are in rad, mm for
/// prismatic joints, in the order of the joints.
///
/// Each elementary transform moves along or about one axis of the moving frame, so the derivative of the tool position
/// by its value is that axis (translation) or axis x (p - o) (rotation, o a point on the axis).
class Kinematics {
 public:
  /// Validates the chain.
  explicit Kinematics(const Chain& chain);

  /// The same chain with other geometric values; cheaper than compiling anew.
  void set_values(const Eigen::VectorXd& values);

  std::size_t joints() const { return variable_.size(); }

  Pose forward(const Eigen::VectorXd& q, const Deformation* deformation = nullptr) const;

  Skeleton skeleton(const Eigen::VectorXd& q, const Deformation* deformation = nullptr) const;

  /// The same, written into an existing object without allocating memory.
  void skeleton_into(Skeleton& skeleton, const Eigen::VectorXd& q, const Deformation* deformation = nullptr) const;

  /// Of each geometric parameter in the order of geometric_parameters(), without those of further bases and tools; per
  /// rad or mm. Written into an existing object without allocating memory. Returns the tool pose, as forward().
  Pose motions_into(std::vector<Motion>& motions, const Eigen::VectorXd& q,
                    const Deformation* deformation = nullptr) const;

  /// 3 x P derivatives of the tool position by the geometric parameters in the order of geometric_parameters(), without
  /// those of further bases and tools: mm per mm, mm per deg.
  Eigen::Matrix3Xd position_jacobian(const Eigen::VectorXd& q) const;

  /// 6 x J derivatives by the joint values: position in mm (upper rows), rotation vector in rad (lower rows), per rad
  /// or mm.
  Eigen::Matrix<double, 6, Eigen::Dynamic> joint_jacobian(const Eigen::VectorXd& q) const;

 private:
  struct Element {
    int axis;                // 0, 1, 2 = x, y, z
    bool rotation;           // else translation
    Eigen::Index parameter;  // the geometric parameter that is its value
    int joint = -1;          // the joint whose value is added, or -1
    double value = 0.0;      // mm or rad
    double sine = 0.0;
    double cosine = 1.0;
  };
  std::vector<Element> elements_;
  std::vector<std::size_t> variable_;    // element moved by each joint
  std::vector<std::size_t> body_frame_;  // element after which each joint's moving frame is reached
  std::vector<double> sign_;
  std::vector<Eigen::Vector3d> body_centre_mm_;
  Eigen::Vector3d payload_centre_mm_;
  std::size_t base_end_ = 0;  // elements of the base frame

  void add(int axis, bool rotation, Eigen::Index parameter);
  void add_frame(Eigen::Index first_parameter);
  void add_joint(const Chain& chain, std::size_t index);
  template <typename Reach, typename Visit>
  Pose walk(const Eigen::VectorXd& q, const Deformation* deformation, Reach reach, Visit visit) const;
};

/// Tool pose of a chain. For many poses construct a Kinematics once instead.
Pose forward(const Chain& chain, const Eigen::VectorXd& q);

}  // namespace llmt::robotics
