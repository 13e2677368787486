/// \file
/// What a serial arm is: joints by Denavit-Hartenberg parameters between a base and a tool frame.
///
///     Chain arm;
///     arm.joints.resize(2);
///     arm.joints[0].a_mm = 300.0;
///     arm.joints[1].a_mm = 200.0;
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/discovery/least_squares.hpp"

namespace llmt::robotics {

/// Which Denavit-Hartenberg convention the joints follow. R and T are rotations about and translations along an axis of
/// the moving frame, q is the joint value times `sign`; b and beta are extras, zero in both textbook conventions.
///
///   dh   (standard):        Rz(theta + q) Tz(d) Tx(a) Ty(b) Rx(alpha) Ry(beta)
///   mdh  (modified, Craig): Rx(alpha) Tx(a) Ty(b) Ry(beta) Rz(theta + q) Tz(d)
///
/// A prismatic joint adds q to d instead of theta. beta is the extra angle of Hayati (1983) for consecutive axes that
/// are nearly parallel, where a, alpha, d, theta alone change by metres for a tilt of microradians.
enum class Convention { dh, mdh };

enum class JointType { revolute, prismatic };

/// A fixed frame: translation, then fixed-axis roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll).
struct Frame {
  Eigen::Vector3d xyz_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d rpy_deg = Eigen::Vector3d::Zero();
};

/// One more frame of the same kind as the base or the tool of a chain.
struct NamedFrame {
  std::string name;
  Frame frame;
  double radius_mm = 0.0;  ///< of a base that is a sphere, see is_sphere(); else without meaning
};

/// How a joint without a drive of its own follows another: q = multiplier q_joint + offset.
struct Mimic {
  std::string joint;        ///< that has a drive
  double multiplier = 1.0;  ///< rad or mm per rad or mm
  double offset = 0.0;      ///< degrees, or mm for a prismatic joint
};

/// One joint and the link it moves. Angles are kept in degrees, as in files, so that reading and writing lose nothing.
struct Joint {
  std::string name;
  JointType type = JointType::revolute;
  double alpha_deg = 0.0;
  double a_mm = 0.0;
  double d_mm = 0.0;
  double theta_deg = 0.0;
  double beta_deg = 0.0;                        ///< see Convention
  double b_mm = 0.0;                            ///< see Convention; the paper's bent links, eq. (12)-(13), have b = -v
  double sign = 1.0;                            ///< +1 or -1
  std::optional<std::array<double, 2>> limits;  ///< lower, upper; degrees, or mm for a prismatic joint
  std::optional<double> gear_ratio;             ///< motor turns per joint turn
  std::optional<Mimic> mimic;                   ///< as in a URDF; empty: the joint has a drive
  double mass_kg = 0.0;                         ///< of the link that the joint moves
  Eigen::Vector3d com_mm = Eigen::Vector3d::Zero();  ///< its centre of mass in the joint's moving frame
};

/// What the flange carries.
struct Payload {
  double mass_kg = 0.0;
  Eigen::Vector3d com_mm = Eigen::Vector3d::Zero();  ///< in the tool frame
};

/// A serial arm. `base` is T_world_base, `tool` is T_flange_tool. Where an instrument was set up several times, or
/// several targets are mounted, the first has `base` and `tool`, and the others stand by name in `bases` and `tools`;
/// only observations that name them use them.
struct Chain {
  std::string name;
  Convention convention = Convention::dh;
  Eigen::Vector3d gravity_m_s2 = {0.0, 0.0, -9.81};  ///< in the base frame: a tracker's world need not be level
  std::string orientation;  ///< convention of rx, ry, rz in measurement files, e.g. "intrinsic_xyz"
  Frame base;
  Frame tool;
  std::string session = {};            ///< name in measurement files of the set-up that `base` stands for, or empty
  std::string target = {};             ///< name in measurement files of what `tool` stands for, or empty
  std::vector<NamedFrame> bases = {};  ///< T_world_base of further sessions
  std::vector<NamedFrame> tools = {};  ///< T_flange_tool of further targets
  std::vector<Joint> joints;
  Payload payload;
};

/// Throws std::invalid_argument naming joint, field, value and bound: no joints or more than 100, repeated or empty
/// joint names, names that collide with "base" or "tool", non-finite numbers, sign other than +1 or -1, limits out of
/// order, a mimic of no joint or of one that mimics another, negative mass, further bases or tools without a name, with
/// a dot in it, or of the same name.
void validate(const Chain& chain);

/// The geometric parameters in their fixed order: base.{x,y,z,rx,ry,rz}, tool.{...}, then per joint
/// {theta,d,a,b,alpha,beta}, named "joint2.a" after the joint, then `base@NAME.x`, ... of further bases,
/// `tool@NAME.x`, ... of further tools, and `base@NAME.radius` of bases that are spheres. Units mm and deg; scales 1 mm
/// and 0.1 deg. All are free; whoever calibrates decides.
std::vector<discovery::Parameter> geometric_parameters(const Chain& chain);

/// Sum of the lengths of all links and of the tool: no point of the arm is farther from its base, mm.
double reach_of(const Chain& chain);

/// Number of geometric parameters: 12 + 6 per joint and per further base or tool + 1 per sphere.
Eigen::Index geometric_parameter_count(const Chain& chain);

/// Their values in that order.
Eigen::VectorXd geometric_values(const Chain& chain);

/// The chain with those values. Throws std::invalid_argument on a wrong count.
Chain with_geometric_values(Chain chain, const Eigen::VectorXd& values);

/// From joint values (rad, mm) to the unit of the limits (degrees, mm): the factor, and "deg" or "mm".
double to_limit_unit(const Joint& joint);
std::string limit_unit(const Joint& joint);

/// Joint values, n x J in rad and mm, with those of joints that mimic others computed from the others.
Eigen::MatrixXd with_mimics(const Chain& chain, Eigen::MatrixXd joints);

/// Number of joints that mimic no other.
Eigen::Index drive_count(const Chain& chain);

/// Position of a joint by its name. Throws std::invalid_argument if there is none.
std::size_t joint_index(const Chain& chain, std::string_view name);

/// The chain as it stands in that session and with that target: their frames become `base` and `tool`, `bases` and
/// `tools` are empty. Empty names stand for the chain's own. Throws std::invalid_argument, with the names that it
/// knows, for another one.
Chain in_session(Chain chain, const std::string& session, const std::string& target);

/// Whether a parameter of that name belongs to a base or a tool.
bool is_frame_parameter(std::string_view name);

/// Whether a base stands for a ball socket, by its name, "socket NAME": then its origin is the centre of the ball,
/// which every reading finds there, and its axes are any.
bool is_socket(std::string_view base);

/// Whether a base stands for a flat surface, by its name, "plane NAME": then its x and y axes lie in the plane that
/// every reading finds the tool point in.
bool is_plane(std::string_view base);

/// Whether a base stands for a sphere of unknown radius, by its name, "sphere NAME": then its origin is the centre, its
/// axes are any, and every reading finds the tool point at the distance NamedFrame::radius_mm from the centre.
bool is_sphere(std::string_view base);

/// Whether a base stands for a sphere whose radius is given with the readings, by its name, "known sphere NAME": its
/// origin is the centre, and its axes are any.
bool is_known_sphere(std::string_view base);

/// Whether a base stands for something that the tool touches, a socket, a plane or a sphere, and not for a set-up of an
/// instrument.
bool is_touched(std::string_view base);

/// Position of a geometric parameter in the fixed order.
enum class FrameParameter { x, y, z, rx, ry, rz };
enum class JointParameter { theta, d, a, b, alpha, beta };
Eigen::Index base_parameter(FrameParameter which);
Eigen::Index tool_parameter(FrameParameter which);
Eigen::Index joint_parameter(std::size_t joint, JointParameter which);

}  // namespace llmt::robotics
