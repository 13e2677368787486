/// \file
/// Elastic and loose arms at rest, by MuJoCo.
#pragma once

#include <memory>
#include <optional>

#include "blind/arm.hpp"

namespace blind {

/// A link as a chain of rigid segments with elastic hinges about both normals (and the axis, if it may twist).
struct ElasticBar {
  int joint = 0;             ///< from 0, the joint that moves the link
  double flexibility = 0.0;  ///< 1/EI, 1/(N m^2); 0: stiff
  double torsion = 0.0;      ///< 1/GJ, 1/(N m^2); 0: stiff
  int segments = 20;
};

/// Play between motor and link: the link is free within +-half_width of the motor.
struct Play {
  int joint = 0;
  double half_width = 0.0;       ///< rad
  double stop_compliance = 0.0;  ///< of the stop, rad/(N m)
  double friction = 0.0;         ///< N m that hold the link where the approach left it; 0: gravity decides
};

/// A helical spring between a point beside a joint and a point of the link that it moves, in the plane of motion.
struct Spring {
  int joint = 0;
  Eigen::Vector3d anchor;  ///< in the frame before the joint's rotation, m
  Eigen::Vector3d lug;     ///< in the joint's moving frame, m
  double stiffness = 0.0;  ///< N/m
  double length = 0.0;     ///< unloaded, m
};

/// Everything that may give way.
struct Elasticity {
  std::vector<double> joint_compliance;  ///< one a joint or empty, rad/(N m)
  std::vector<ElasticBar> bars;
  double base_compliance = 0.0;  ///< about the two horizontal axes (planar: about z) of the base, rad/(N m)
  std::vector<Play> plays;
  std::optional<Spring> spring;
  Eigen::Vector3d gravity_change = Eigen::Vector3d::Zero();  ///< m/s^2, base frame
  double extra_payload = 0.0;                                ///< kg
  Eigen::Vector3d payload_com_change = Eigen::Vector3d::Zero();

  bool rigid() const;
};

/// An arm in static equilibrium: gravity, springs and stops, no motion.
class StaticArm {
 public:
  StaticArm(const Arm& arm, const Elasticity& elasticity);
  ~StaticArm();
  StaticArm(StaticArm&&) noexcept;

  /// Tool point in the base frame, m, motors at q (rad). `approach`: side (+-1) from which each joint came, needed by
  /// plays with friction. Damped diagonal Newton on the elastic hinges, loose ones by their complementarity. Throws
  /// std::runtime_error if it does not settle.
  Eigen::Vector3d tool_point(const Eigen::VectorXd& q, double payload_kg, const Eigen::VectorXd& approach);

  /// Angles of the loose hinges in the last equilibrium, rad.
  const Eigen::VectorXd& loose() const;

 private:
  struct Engine;
  std::unique_ptr<Engine> engine_;
};

/// MJCF text of the arm. Joints: q1.. (motors), e1.. (elastic), p1.. (loose), base_*, bar*; site "tool"; body
/// "payload".
std::string to_mjcf(const Arm& arm, const Elasticity& elasticity);

}  // namespace blind
