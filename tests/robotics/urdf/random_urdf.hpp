// URDF texts put together at random, and what they say by the rules of the format alone.
#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "llmt/random.hpp"
#include "llmt/robotics/kinematics.hpp"

namespace random_urdf {

struct Joint {
  std::string type;
  Eigen::Vector3d xyz;
  Eigen::Vector3d rpy;
  Eigen::Vector3d axis;
  double mass;
  Eigen::Vector3d centre;
};

inline Eigen::Vector3d some(llmt::Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

// Half of the axes and angles are those that people write: along x, y, z, quarter turns.
inline std::vector<Joint> random_joints(llmt::Random& random) {
  std::vector<Joint> joints;
  const int count = 2 + static_cast<int>(random.uniform(0.0, 6.0));
  for (int moving = 0; moving < count;) {
    Joint joint{.type = "revolute",
                .xyz = some(random, 0.5),
                .rpy = some(random, 3.1),
                .axis = some(random, 1.0),
                .mass = random.uniform(0.5, 5.0),
                .centre = some(random, 0.2)};
    if (random.uniform() < 0.5) joint.axis = Eigen::Vector3d::Unit(static_cast<int>(random.uniform(0.0, 3.0)));
    if (random.uniform() < 0.2) joint.axis = -joint.axis;
    if (random.uniform() < 0.5) {
      for (double& angle : joint.rpy) angle = 1.5707963267948966 * std::floor(random.uniform(-1.0, 3.0));
    }
    if (random.uniform() < 0.2) joint.xyz.setZero();
    const double kind = random.uniform();
    if (kind < 0.15) joint.type = "fixed";
    if (kind > 0.85) joint.type = "prismatic";
    if (kind > 0.70 && kind < 0.85) joint.type = "continuous";
    moving += joint.type == "fixed" ? 0 : 1;
    joints.push_back(joint);
  }
  return joints;
}

inline std::string vector(const Eigen::Vector3d& v) { return fmt::format("{} {} {}", v(0), v(1), v(2)); }

inline std::string text_of(const std::vector<Joint>& joints) {
  std::string text = "<?xml version=\"1.0\"?>\n<robot name=\"random\">\n<!-- kept --><link name=\"l0\"/>\n";
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const Joint& joint = joints[j];
    text += fmt::format(
        "<link name=\"l{0}\"><inertial><origin xyz=\"{1}\" rpy=\"0 0 0\"/><mass value=\"{2}\"/><inertia ixx=\"0.1\" "
        "ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" izz=\"0.1\"/></inertial></link>\n<joint name=\"j{0}\" type=\"{3}\">"
        "<parent link=\"l{4}\"/><child link=\"l{0}\"/><origin xyz=\"{5}\" rpy=\"{6}\"/><axis xyz=\"{7}\"/>"
        "<limit lower=\"-1\" upper=\"1.5\" effort=\"1\" velocity=\"1\"/></joint>\n",
        j + 1, vector(joint.centre), joint.mass, joint.type, j, vector(joint.xyz), vector(joint.rpy),
        vector(joint.axis));
  }
  return text + "</robot>\n";
}

/// Frames of all links, in mm, by one product of transforms after the other.
struct Placed {
  std::vector<Eigen::Isometry3d> links;  // behind each joint
  std::vector<Eigen::Vector3d> axes;     // of the joints that move
  std::vector<Eigen::Vector3d> points;   // on them
  std::vector<bool> slides;
};

inline Placed placed(const std::vector<Joint>& joints, const Eigen::VectorXd& q) {
  Placed result;
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  int next = 0;
  for (const Joint& joint : joints) {
    frame.translate(1000.0 * joint.xyz);
    frame.rotate(Eigen::AngleAxisd(joint.rpy(2), Eigen::Vector3d::UnitZ()) *
                 Eigen::AngleAxisd(joint.rpy(1), Eigen::Vector3d::UnitY()) *
                 Eigen::AngleAxisd(joint.rpy(0), Eigen::Vector3d::UnitX()));
    if (joint.type != "fixed") {
      const Eigen::Vector3d axis = joint.axis.normalized();
      result.axes.push_back(frame.linear() * axis);
      result.points.push_back(frame.translation());
      result.slides.push_back(joint.type == "prismatic");
      if (joint.type == "prismatic") {
        frame.translate(q(next++) * axis);
      } else {
        frame.rotate(Eigen::AngleAxisd(q(next++), axis));
      }
    }
    result.links.push_back(frame);
  }
  return result;
}

inline Eigen::VectorXd random_values(const llmt::robotics::Chain& chain, llmt::Random& random) {
  Eigen::VectorXd q(std::ssize(chain.joints));
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const bool slides = chain.joints[j].type == llmt::robotics::JointType::prismatic;
    q(j) = slides ? random.uniform(-300.0, 300.0) : random.uniform(-3.0, 3.0);
  }
  return q;
}

}  // namespace random_urdf
