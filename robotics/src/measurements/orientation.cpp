#include "llmt/robotics/orientation.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "kinematics/units.hpp"

namespace llmt::robotics {
namespace {

// The axes in the order of the product of matrices, R = R_i R_j R_k.
std::array<int, 3> axes_of(const std::string& convention) {
  const std::string letters = convention.substr(convention.find('_') + 1);
  std::array<int, 3> axes = {letters[0] - 'x', letters[1] - 'x', letters[2] - 'x'};
  if (convention.starts_with("extrinsic")) std::swap(axes[0], axes[2]);
  return axes;
}

Eigen::Matrix3d about(int axis, double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
}

Eigen::Vector3d angles_of(const Eigen::Matrix3d& rotation, const std::array<int, 3>& axes) {
  const auto [i, j, k] = axes;
  const double sign = (j - i + 3) % 3 == 1 ? 1.0 : -1.0;
  Eigen::Vector3d angles;
  angles(i) = std::atan2(-sign * rotation(j, k), rotation(k, k));
  angles(j) = std::atan2(sign * rotation(i, k), std::hypot(rotation(i, i), rotation(i, j)));
  angles(k) = std::atan2(-sign * rotation(i, j), rotation(i, i));
  return angles;
}

}  // namespace

bool is_orientation(const std::string& convention) {
  const std::size_t bar = convention.find('_');
  const std::string kind = convention.substr(0, bar);
  if (bar == std::string::npos || (kind != "intrinsic" && kind != "extrinsic")) return false;
  std::string letters = convention.substr(bar + 1);
  std::ranges::sort(letters);
  return letters == "xyz";
}

std::vector<Eigen::Matrix3d> rotations_of(const Orientation& orientation, const std::string& convention) {
  if (orientation.values.rows() == 0) return {};
  const bool angles = orientation.kind == Orientation::Kind::angles_deg;
  if (angles && !is_orientation(convention)) {
    throw std::invalid_argument(
        fmt::format("llmt::robotics::rotations_of: rx, ry, rz have {}: write orientation: intrinsic_xyz, extrinsic_xyz "
                    "or another order of the axes into the description of the robot or into a column map",
                    convention.empty() ? "no convention" : fmt::format("an unknown convention, \"{}\"", convention)));
  }
  std::vector<Eigen::Matrix3d> rotations;
  for (Eigen::Index row = 0; row < orientation.values.rows(); ++row) {
    const Eigen::VectorXd values = orientation.values.row(row).transpose();
    if (angles) {
      const std::array<int, 3> axes = axes_of(convention);
      Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
      for (const int axis : axes) rotation *= about(axis, radians * values(axis));
      rotations.push_back(rotation);
      continue;
    }
    if (!(values.norm() > 0.0)) {
      throw std::invalid_argument(
          fmt::format("llmt::robotics::rotations_of: quaternion of row {} has length 0", row + 1));
    }
    rotations.push_back(Eigen::Quaterniond(values(0), values(1), values(2), values(3)).normalized().toRotationMatrix());
  }
  return rotations;
}

Orientation to_orientation(const std::vector<Eigen::Matrix3d>& rotations, const std::string& convention) {
  Orientation orientation;
  const bool angles = is_orientation(convention);
  orientation.kind = angles ? Orientation::Kind::angles_deg : Orientation::Kind::quaternion;
  orientation.values.resize(std::ssize(rotations), angles ? 3 : 4);
  for (std::size_t row = 0; row < rotations.size(); ++row) {
    if (angles) {
      orientation.values.row(row) = angles_of(rotations[row], axes_of(convention)).transpose() / radians;
      continue;
    }
    Eigen::Quaterniond q(rotations[row]);
    if (q.w() < 0.0) q.coeffs() *= -1.0;
    orientation.values.row(row) << q.w(), q.x(), q.y(), q.z();
  }
  return orientation;
}

}  // namespace llmt::robotics
