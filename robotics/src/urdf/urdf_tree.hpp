// The part of a URDF that is the arm, with all poses at zero in the frame of the base link, in mm.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "llmt/robotics/chain.hpp"
#include "llmt/robotics/urdf_links.hpp"

namespace llmt::robotics {

inline constexpr double mm = 1000.0;  // per metre

struct UrdfJoint {
  std::string name;
  JointType type = JointType::revolute;
  Eigen::Isometry3d parent;  ///< of the link before the joint
  Eigen::Isometry3d child;   ///< of the link that it moves
  Eigen::Vector3d axis;      ///< unit vector
  std::optional<std::array<double, 2>> limits;
  std::optional<Mimic> mimic;  ///< as in a chain
  double mass_kg = 0.0;
  Eigen::Vector3d com_mm = Eigen::Vector3d::Zero();
};

/// The fixed joint that holds a tip link which carries no further links.
struct UrdfTip {
  std::string joint;
  Eigen::Isometry3d parent;  ///< of the link before it
};

struct UrdfArm {
  std::string name;
  std::vector<UrdfJoint> joints;
  Eigen::Isometry3d tip;
  std::optional<UrdfTip> fixed_tip;  ///< empty: there is none
};

/// Throws as parse_urdf().
UrdfArm urdf_arm(const std::string& text, const std::string& name, const UrdfLinks& links);

/// Frames 0 ... J of the chain that parse_urdf() makes.
std::vector<Eigen::Isometry3d> frames_of(const UrdfArm& arm);

}  // namespace llmt::robotics
