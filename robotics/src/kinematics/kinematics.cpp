#include "llmt/robotics/kinematics.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "kinematics/units.hpp"

namespace llmt::robotics {
namespace {

// R := R * rotation about its own axis: only the other two columns change.
void rotate(Eigen::Matrix3d& rotation, int axis, double sine, double cosine) {
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  const Eigen::Vector3d first = rotation.col(u);
  rotation.col(u) = cosine * first + sine * rotation.col(v);
  rotation.col(v) = cosine * rotation.col(v) - sine * first;
}

void apply(Pose& frame, const Deformation::Twist& twist) {
  frame.position_mm += twist.translation_mm;
  const double angle = twist.rotation_rad.norm();
  if (angle > 0.0) {
    frame.rotation = Eigen::AngleAxisd(angle, twist.rotation_rad / angle).toRotationMatrix() * frame.rotation;
  }
}

}  // namespace

Eigen::Vector3d Motion::of(const Eigen::Vector3d& moving) const {
  if (!turns) return axis;
  return axis.cross(moving - point);
}

Eigen::Vector3d Motion::turn() const {
  if (!turns) return Eigen::Vector3d::Zero();
  return axis;
}

void Deformation::clear() {
  base = {};
  joint.setZero();
  std::ranges::fill(link, Twist{});
  world_mm.setZero();
}

void Kinematics::add(int axis, bool rotation, Eigen::Index parameter) {
  elements_.push_back({axis, rotation, parameter, -1, 0.0, 0.0, 1.0});
}

void Kinematics::add_frame(Eigen::Index first) {
  for (int axis = 0; axis < 3; ++axis) add(axis, false, first + axis);
  for (int axis = 2; axis >= 0; --axis) add(axis, true, first + 3 + axis);  // Rz Ry Rx
}

void Kinematics::add_joint(const Chain& chain, std::size_t index) {
  const auto parameter = [&](JointParameter which) { return joint_parameter(index, which); };
  const auto along_and_about_z = [&] {
    variable_.push_back(elements_.size() + (chain.joints[index].type == JointType::revolute ? 0 : 1));
    add(2, true, parameter(JointParameter::theta));
    add(2, false, parameter(JointParameter::d));
    elements_[variable_.back()].joint = static_cast<int>(index);
  };
  const auto along_x_and_y = [&] {
    add(0, false, parameter(JointParameter::a));
    add(1, false, parameter(JointParameter::b));
  };
  if (chain.convention == Convention::dh) {
    along_and_about_z();
    along_x_and_y();
    add(0, true, parameter(JointParameter::alpha));
    add(1, true, parameter(JointParameter::beta));
  } else {
    add(0, true, parameter(JointParameter::alpha));
    along_x_and_y();
    add(1, true, parameter(JointParameter::beta));
    along_and_about_z();
  }
  body_frame_.push_back(elements_.size());
}

Kinematics::Kinematics(const Chain& chain) : payload_centre_mm_(chain.payload.com_mm) {
  validate(chain);
  add_frame(base_parameter(FrameParameter::x));
  base_end_ = elements_.size();
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    add_joint(chain, j);
    sign_.push_back(chain.joints[j].sign);
    body_centre_mm_.push_back(chain.joints[j].com_mm);
  }
  add_frame(tool_parameter(FrameParameter::x));
  set_values(geometric_values(chain).head(std::ssize(elements_)));
}

void Kinematics::set_values(const Eigen::VectorXd& values) {
  if (values.size() != std::ssize(elements_)) {
    throw std::invalid_argument("llmt::robotics::Kinematics::set_values: values has " + std::to_string(values.size()) +
                                " entries, must be " + std::to_string(elements_.size()));
  }
  for (Element& element : elements_) {
    element.value = values(element.parameter) * (element.rotation ? radians : 1.0);
    if (!element.rotation) continue;
    element.sine = std::sin(element.value);
    element.cosine = std::cos(element.value);
  }
}

// Calls visit(element number, frame before the element) for every element, then returns the tool pose. The deformation
// of a link acts just before the axis of the next joint, that of the last link at the tool point, that of the base just
// before the first axis. reach(element number, frame) comes before it acts.
template <typename Reach, typename Visit>
Pose Kinematics::walk(const Eigen::VectorXd& q, const Deformation* deformation, Reach reach, Visit visit) const {
  if (q.size() != std::ssize(variable_)) {
    throw std::invalid_argument("llmt::robotics::Kinematics: q has " + std::to_string(q.size()) +
                                " entries, the chain has " + std::to_string(joints()) + " joints");
  }
  Pose frame;
  for (std::size_t i = 0; i < elements_.size(); ++i) {
    const Element& element = elements_[i];
    double sine = element.sine;
    double cosine = element.cosine;
    double value = element.value;
    reach(i, frame);
    if (element.joint >= 0) {
      const std::size_t joint = element.joint;
      if (deformation != nullptr) apply(frame, joint > 0 ? deformation->link[joint - 1] : deformation->base);
      double moved = q(element.joint);
      if (deformation != nullptr) moved += deformation->joint(element.joint);
      value += sign_[joint] * moved;
      sine = std::sin(value);
      cosine = std::cos(value);
    }
    visit(i, frame);
    if (element.rotation) {
      rotate(frame.rotation, element.axis, sine, cosine);
    } else {
      frame.position_mm += value * frame.rotation.col(element.axis);
    }
  }
  if (deformation != nullptr) {
    if (!deformation->link.empty()) apply(frame, deformation->link.back());
    frame.position_mm += deformation->world_mm;
  }
  return frame;
}

Pose Kinematics::forward(const Eigen::VectorXd& q, const Deformation* deformation) const {
  const auto nothing = [](std::size_t, const Pose&) {};
  return walk(q, deformation, nothing, nothing);
}

Skeleton Kinematics::skeleton(const Eigen::VectorXd& q, const Deformation* deformation) const {
  Skeleton skeleton;
  skeleton_into(skeleton, q, deformation);
  return skeleton;
}

void Kinematics::skeleton_into(Skeleton& skeleton, const Eigen::VectorXd& q, const Deformation* deformation) const {
  for (auto* points : {&skeleton.joint_origin, &skeleton.joint_axis, &skeleton.link_end, &skeleton.body_centre}) {
    points->resize(joints());
  }
  skeleton.joint_frame.resize(joints());
  skeleton.body_rotation.resize(joints());
  std::size_t body = 0;
  const auto reach = [&](std::size_t i, const Pose& frame) {
    if (i == base_end_) skeleton.base_rotation = frame.rotation;
    if (body < joints() && i == body_frame_[body]) {
      skeleton.body_centre[body] = frame.position_mm + frame.rotation * body_centre_mm_[body];
      skeleton.body_rotation[body] = frame.rotation;
      ++body;
    }
  };
  const auto visit = [&](std::size_t i, const Pose& frame) {
    if (elements_[i].joint < 0) return;
    const std::size_t joint = elements_[i].joint;
    if (joint > 0) skeleton.link_end[joint - 1] = frame.position_mm;
    skeleton.joint_origin[joint] = frame.position_mm;
    skeleton.joint_frame[joint] = frame.rotation;
    skeleton.joint_axis[joint] = sign_[joint] * frame.rotation.col(2);
  };
  skeleton.tool = walk(q, deformation, reach, visit);
  if (deformation != nullptr) skeleton.tool.position_mm -= deformation->world_mm;
  skeleton.link_end.back() = skeleton.tool.position_mm;
  skeleton.payload_centre = skeleton.tool.position_mm + skeleton.tool.rotation * payload_centre_mm_;
}

Pose Kinematics::motions_into(std::vector<Motion>& motions, const Eigen::VectorXd& q,
                              const Deformation* deformation) const {
  motions.resize(elements_.size());
  std::size_t joint = 0;
  std::size_t body = 0;
  const auto nothing = [](std::size_t, const Pose&) {};
  return walk(q, deformation, nothing, [&](std::size_t i, const Pose& frame) {
    while (joint < joints() && variable_[joint] <= i) ++joint;
    while (body < joints() && body_frame_[body] <= i) ++body;
    const Element& element = elements_[i];
    Motion& motion = motions[element.parameter];
    motion.axis = frame.rotation.col(element.axis);
    motion.point = frame.position_mm;
    motion.turns = element.rotation;
    motion.turns_base = element.rotation && i < base_end_;
    motion.first_joint = motion.first_twist = joint;
    motion.first_body = body;
  });
}

Eigen::Matrix3Xd Kinematics::position_jacobian(const Eigen::VectorXd& q) const {
  std::vector<Motion> motions;
  const Eigen::Vector3d tool = motions_into(motions, q).position_mm;
  Eigen::Matrix3Xd jacobian(3, motions.size());
  for (std::size_t k = 0; k < motions.size(); ++k) {
    jacobian.col(k) = (motions[k].turns ? radians : 1.0) * motions[k].of(tool);
  }
  return jacobian;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> Kinematics::joint_jacobian(const Eigen::VectorXd& q) const {
  const Skeleton skeleton = this->skeleton(q);
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, joints());
  for (std::size_t j = 0; j < joints(); ++j) {
    const Eigen::Index column = j;
    const Eigen::Vector3d& axis = skeleton.joint_axis[j];
    if (elements_[variable_[j]].rotation) {
      jacobian.col(column) << axis.cross(skeleton.tool.position_mm - skeleton.joint_origin[j]), axis;
    } else {
      jacobian.col(column) << axis, Eigen::Vector3d::Zero();
    }
  }
  return jacobian;
}

Pose forward(const Chain& chain, const Eigen::VectorXd& q) { return Kinematics(chain).forward(q); }

}  // namespace llmt::robotics
