#include "kinematics/rigid_fit.hpp"

#include <Eigen/SVD>

namespace llmt::robotics {

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
