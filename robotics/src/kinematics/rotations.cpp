#include "kinematics/rotations.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

namespace llmt::robotics {

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond q(rotation);
  const double sine = q.vec().norm();  // of half the angle
  if (sine == 0.0) return Eigen::Vector3d::Zero();
  const double half = std::atan2(sine, std::abs(q.w()));
  return (q.w() < 0.0 ? -2.0 : 2.0) * half / sine * q.vec();
}

Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& r) {
  const double pitch = std::atan2(-r(2, 0), std::hypot(r(0, 0), r(1, 0)));
  if (std::abs(std::cos(pitch)) < 1e-12) return {std::atan2(-r(1, 2), r(1, 1)), pitch, 0.0};
  // Near upright roll is uncertain. Yaw is that of what is left of the rotation without it, so that both together are
  // exact.
  const double roll = std::atan2(r(2, 1), r(2, 2));
  const Eigen::Vector3d left = std::cos(roll) * r.col(1) - std::sin(roll) * r.col(2);
  return {roll, pitch, std::atan2(-left(0), left(1))};
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return matrix;
}

Eigen::Matrix3d rotation_of_greatest_trace(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d handedness = Eigen::Vector3d::Ones();
  if ((svd.matrixV() * svd.matrixU().transpose()).determinant() < 0.0) handedness(2) = -1.0;
  return svd.matrixV() * handedness.asDiagonal() * svd.matrixU().transpose();
}

Pose kabsch(const Eigen::MatrixXd& from, const Eigen::MatrixXd& to) {
  const Eigen::RowVector3d centre_from = from.colwise().mean();
  const Eigen::RowVector3d centre_to = to.colwise().mean();
  const Eigen::Matrix3d covariance = (from.rowwise() - centre_from).transpose() * (to.rowwise() - centre_to);
  Pose pose;
  pose.rotation = rotation_of_greatest_trace(covariance);
  pose.position_mm = centre_to.transpose() - pose.rotation * centre_from.transpose();
  return pose;
}

}  // namespace llmt::robotics
