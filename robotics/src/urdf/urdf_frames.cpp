// Denavit-Hartenberg frames on the axes of a URDF.
#include <cmath>

#include "kinematics/units.hpp"
#include "urdf/urdf_tree.hpp"

namespace llmt::robotics {
namespace {

constexpr double nearly_parallel_deg = 5.0;

struct Line {
  Eigen::Vector3d point;
  Eigen::Vector3d direction;
};

Eigen::Isometry3d frame_at(const Eigen::Vector3d& origin, const Eigen::Vector3d& z, const Eigen::Vector3d& wanted_x) {
  const Eigen::Vector3d x = (wanted_x - wanted_x.dot(z) * z).normalized();
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() << x, z.cross(x), z;
  frame.translation() = origin;
  return frame;
}

// Any direction square to z, near `wanted` if that is one.
Eigen::Vector3d square_to(const Eigen::Vector3d& z, const Eigen::Vector3d& wanted) {
  const Eigen::Vector3d left = wanted - wanted.dot(z) * z;
  return left.norm() > 0.1 ? Eigen::Vector3d(left.normalized()) : z.unitOrthogonal();
}

Eigen::Vector3d turned_to(const Eigen::Vector3d& direction, const Eigen::Vector3d& like) {
  return direction.dot(like) < -1e-9 ? Eigen::Vector3d(-direction) : direction;
}

}  // namespace

std::vector<Eigen::Isometry3d> frames_of(const UrdfArm& arm) {
  std::vector<Eigen::Isometry3d> frames;
  Line here{Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ()};
  Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  for (const UrdfJoint& joint : arm.joints) {
    const Line next{joint.child.translation(), joint.axis};
    const Eigen::Vector3d normal = here.direction.cross(next.direction);
    const double sine = normal.norm();
    const Eigen::Vector3d between = next.point - here.point;
    Eigen::Vector3d foot = here.point;
    Eigen::Vector3d landing;
    if (sine > std::sin(radians * nearly_parallel_deg)) {
      foot += between.cross(next.direction).dot(normal) / (sine * sine) * here.direction;
      landing = next.point + between.cross(here.direction).dot(normal) / (sine * sine) * next.direction;
      x = turned_to(normal / sine, x);
    } else {
      const Eigen::Vector3d aside = between - between.dot(here.direction) * here.direction;
      if (aside.norm() > 1e-6) x = turned_to(aside.normalized(), x);
      landing = next.point - between.dot(here.direction) / next.direction.dot(here.direction) * next.direction;
    }
    frames.push_back(frame_at(foot, here.direction, x));
    here = {landing, next.direction};
    x = square_to(here.direction, x);
  }
  const Eigen::Isometry3d& last = arm.joints.back().child;
  frames.push_back(frame_at(last.translation(), here.direction, square_to(here.direction, last.linear().col(0))));
  return frames;
}

}  // namespace llmt::robotics
