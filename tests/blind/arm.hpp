/// \file
/// Serial arms of the blind test: their own description, kinematics and statics in SI units (m, rad, kg, N).
///
/// Nothing here is shared with llmt::robotics, on purpose: data for a tool must not come from the tool's formulas.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace blind {

/// A frame as x, y, z (m) and fixed-axis roll, pitch, yaw (rad).
struct Frame {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
  Eigen::Vector3d rpy = Eigen::Vector3d::Zero();
  Eigen::Isometry3d transform() const;
};

struct Joint {
  double alpha = 0.0, a = 0.0, b = 0.0, d = 0.0, theta = 0.0, beta = 0.0;  ///< rad, m
  double low = 0.0, high = 0.0;                                            ///< limits, rad
  double gear_ratio = 0.0;                                                 ///< motor turns per joint turn; 0: not told
  double mass = 0.0;                                                       ///< of the link that it moves, kg
  Eigen::Vector3d com = Eigen::Vector3d::Zero();                           ///< in the joint's frame, m
};

/// Modified (mdh) or standard (dh) Denavit-Hartenberg parameters with an extra angle beta and offset b:
/// mdh Rx(alpha) T(a, b, 0) Ry(beta) Rz(theta + q) Tz(d); dh Rz(theta + q) Tz(d) T(a, b, 0) Rx(alpha) Ry(beta).
struct Arm {
  std::string name;
  bool mdh = true;
  bool planar = false;                          ///< moves in x, y only
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};  ///< in the base frame, m/s^2
  Frame base, tool;
  double payload = 0.0;                                   ///< kg
  Eigen::Vector3d payload_com = Eigen::Vector3d::Zero();  ///< in the tool frame, m
  std::vector<Joint> joints;

  int size() const { return static_cast<int>(joints.size()); }
};

/// An arm as rotations about z between rigid pieces: p = base R(0) Rz(q_1) R(1) Rz(q_2) ... R(J), all that a pose
/// needs.
struct Pieces {
  explicit Pieces(const Arm& arm);
  Eigen::Isometry3d base;
  std::vector<Eigen::Isometry3d> rigid;  ///< J + 1; the last one leads to the tool
  std::vector<Eigen::Vector3d> com;      ///< of each link, in the frame just after Rz(q_j), m
  std::vector<double> mass;              ///< kg
  Eigen::Vector3d payload_com;           ///< in the tool frame, m
  Eigen::Vector3d gravity;
};

/// What effects do to an arm in one pose.
struct Change {
  explicit Change(int joints);
  Eigen::VectorXd angle;              ///< added to the joint values, rad
  std::vector<Eigen::Vector3d> tilt;  ///< J + 1 rotation vectors before each Rz(q_j) and before the tool piece
  std::vector<double> stretch;        ///< J + 1: relative growth of each rigid piece
  Eigen::Isometry3d world = Eigen::Isometry3d::Identity();  ///< the instrument's frame moves, m
};

/// Frames just after each Rz(q_j), and the tool's, J + 1 of them, in the instrument's frame.
std::vector<Eigen::Isometry3d> frames(const Pieces& pieces, const Eigen::VectorXd& q, const Change* change = nullptr);

/// Tool position in the instrument's frame, m.
Eigen::Vector3d tool_point(const Pieces& pieces, const Eigen::VectorXd& q, const Change* change = nullptr);

/// Torque of gravity about each joint, N m, by central differences of the potential energy: tau_j = -dV/dq_j.
Eigen::VectorXd gravity_torque(const Pieces& pieces, const Eigen::VectorXd& q, double payload_kg);

/// A straight elastic bar between two joints, in the frame just after Rz(q_j).
struct Bar {
  Eigen::Vector3d start;      ///< m
  Eigen::Vector3d direction;  ///< unit vector
  double length = 0.0;        ///< m
};

/// The bar that link `joint` (from 0) consists of. It runs along the longer of a and d; where that is a, it lies in the
/// plane of the link's centre of mass, because along parallel axes the origins of the description are arbitrary.
Bar bar_of_link(const Arm& arm, int joint);

/// YAML text of the description that the tool gets. `elastic_joints` with `compliance` (rad/(N m)) become its effects.
std::string to_yaml(const Arm& arm, const std::vector<int>& elastic_joints, const std::vector<double>& compliance);

}  // namespace blind
