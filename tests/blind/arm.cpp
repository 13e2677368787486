#include "blind/arm.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace blind {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

Isometry3d turn(const Vector3d& axis, double angle) { return Isometry3d(Eigen::AngleAxisd(angle, axis)); }
Isometry3d shift(double x, double y, double z) { return Isometry3d(Eigen::Translation3d(x, y, z)); }
Isometry3d turn_by(const Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  return angle > 0.0 ? turn(rotation_vector / angle, angle) : Isometry3d::Identity();
}

// The part of a joint's transform that does not depend on q. In mdh it comes before the rotation, in dh after it.
Isometry3d constant_part(const Joint& joint, bool mdh) {
  const Isometry3d twist = turn(Vector3d::UnitX(), joint.alpha);
  const Isometry3d side = shift(joint.a, joint.b, 0.0);
  const Isometry3d extra = turn(Vector3d::UnitY(), joint.beta);
  const Isometry3d screw = turn(Vector3d::UnitZ(), joint.theta) * shift(0.0, 0.0, joint.d);
  return mdh ? twist * side * extra * screw : screw * side * twist * extra;
}

std::string numbers(const Vector3d& v, double scale) {
  return fmt::format("[{:.10g}, {:.10g}, {:.10g}]", v.x() * scale, v.y() * scale, v.z() * scale);
}

}  // namespace

Isometry3d Frame::transform() const {
  return shift(xyz.x(), xyz.y(), xyz.z()) * turn(Vector3d::UnitZ(), rpy.z()) * turn(Vector3d::UnitY(), rpy.y()) *
         turn(Vector3d::UnitX(), rpy.x());
}

Pieces::Pieces(const Arm& arm) : base(arm.base.transform()), payload_com(arm.payload_com), gravity(arm.gravity) {
  Isometry3d before = Isometry3d::Identity();
  for (const Joint& joint : arm.joints) {
    const Isometry3d constant = constant_part(joint, arm.mdh);
    rigid.push_back(arm.mdh ? before * constant : before);
    before = arm.mdh ? Isometry3d::Identity() : constant;
    com.push_back(before * joint.com);
    mass.push_back(joint.mass);
  }
  rigid.push_back(before * arm.tool.transform());
}

Change::Change(int joints)
    : angle(Eigen::VectorXd::Zero(joints)), tilt(joints + 1, Vector3d::Zero()), stretch(joints + 1, 0.0) {}

std::vector<Isometry3d> frames(const Pieces& pieces, const Eigen::VectorXd& q, const Change* change) {
  std::vector<Isometry3d> result;
  Isometry3d frame = change != nullptr ? change->world * pieces.base : pieces.base;
  for (std::size_t j = 0; j < pieces.rigid.size(); ++j) {
    const bool joint = j + 1 < pieces.rigid.size();
    if (change != nullptr && !joint) frame = frame * turn_by(change->tilt[j]);
    Isometry3d piece = pieces.rigid[j];
    if (change != nullptr) piece.translation() *= 1.0 + change->stretch[j];
    frame = frame * piece;
    if (joint) {
      if (change != nullptr) frame = frame * turn_by(change->tilt[j]);
      const Eigen::Index index = j;
      frame = frame * turn(Vector3d::UnitZ(), q(index) + (change != nullptr ? change->angle(index) : 0.0));
    }
    result.push_back(frame);
  }
  return result;
}

Vector3d tool_point(const Pieces& pieces, const Eigen::VectorXd& q, const Change* change) {
  return frames(pieces, q, change).back().translation();
}

Eigen::VectorXd gravity_torque(const Pieces& pieces, const Eigen::VectorXd& q, double payload_kg) {
  const Vector3d gravity = pieces.base.linear() * pieces.gravity;
  const auto energy = [&](const Eigen::VectorXd& at) {
    const std::vector<Isometry3d> all = frames(pieces, at);
    double sum = -payload_kg * gravity.dot(all.back() * pieces.payload_com);
    for (std::size_t j = 0; j < pieces.com.size(); ++j) sum -= pieces.mass[j] * gravity.dot(all[j] * pieces.com[j]);
    return sum;
  };
  Eigen::VectorXd torque(q.size());
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double step = 1e-4;
    Eigen::VectorXd high = q, low = q;
    high(j) += step;
    low(j) -= step;
    torque(j) = -(energy(high) - energy(low)) / (2.0 * step);
  }
  return torque;
}

Bar bar_of_link(const Arm& arm, int joint) {
  const Pieces pieces(arm);
  const std::size_t next = joint + 1;
  const Isometry3d& piece = pieces.rigid[next];
  if (joint + 1 == arm.size()) {
    const double length = piece.translation().norm();
    return {Vector3d::Zero(), piece.translation() / length, length};
  }
  const Joint& owner = arm.joints[arm.mdh ? next : next - 1];
  const double depth = pieces.com[joint].z();
  if (std::abs(owner.a) >= std::abs(owner.d)) {
    const double angle = arm.mdh ? 0.0 : owner.theta;
    const Vector3d along(std::cos(angle), std::sin(angle), 0.0);
    return {{0.0, 0.0, depth}, owner.a < 0.0 ? Vector3d(-along) : along, std::abs(owner.a)};
  }
  if (!arm.mdh) return {Vector3d::Zero(), Vector3d(0.0, 0.0, owner.d < 0.0 ? -1.0 : 1.0), std::abs(owner.d)};
  const Vector3d along = piece.linear().col(2) * (owner.d < 0.0 ? -1.0 : 1.0);
  return {piece.translation() - along * std::abs(owner.d), along, std::abs(owner.d)};
}

std::string to_yaml(const Arm& arm, const std::vector<int>& elastic_joints, const std::vector<double>& compliance) {
  constexpr double degrees = 180.0 / std::numbers::pi;
  std::string text = fmt::format("name: {}\nconvention: {}\ngravity_m_s2: {}\n", arm.name, arm.mdh ? "mdh" : "dh",
                                 numbers(arm.gravity, 1.0));
  for (const auto& [key, frame] : {std::pair<const char*, const Frame&>{"base", arm.base}, {"tool", arm.tool}}) {
    text += fmt::format("{}: {{xyz_mm: {}, rpy_deg: {}}}\n", key, numbers(frame.xyz, 1e3), numbers(frame.rpy, degrees));
  }
  text +=
      fmt::format("payload: {{mass_kg: {:.10g}, com_mm: {}}}\njoints:\n", arm.payload, numbers(arm.payload_com, 1e3));
  for (int j = 0; j < arm.size(); ++j) {
    const Joint& joint = arm.joints[j];
    text += fmt::format(
        "  - {{name: joint{}, type: revolute, alpha_deg: {:.10g}, a_mm: {:.10g}, d_mm: {:.10g}, theta_deg: {:.10g},\n"
        "     limits_deg: [{:.10g}, {:.10g}],",
        j + 1, joint.alpha * degrees, joint.a * 1e3, joint.d * 1e3, joint.theta * degrees, joint.low * degrees,
        joint.high * degrees);
    if (joint.gear_ratio > 0.0) text += fmt::format(" gear_ratio: {:.10g},", joint.gear_ratio);
    text += fmt::format(" mass_kg: {:.10g}, com_mm: {}}}\n", joint.mass, numbers(joint.com, 1e3));
  }
  if (!elastic_joints.empty()) text += "effects:\n";
  for (std::size_t i = 0; i < elastic_joints.size(); ++i) {
    text += fmt::format("  - {{type: joint_compliance, at: joint{}, compliance_rad_per_Nm: {:.10g}}}\n",
                        elastic_joints[i] + 1, compliance[i]);
  }
  return text;
}

}  // namespace blind
