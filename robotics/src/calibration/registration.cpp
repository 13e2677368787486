#include "calibration/registration.hpp"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

#include "kinematics/rotations.hpp"
#include "kinematics/units.hpp"

namespace llmt::robotics {

namespace {

Frame frame_of(const Pose& pose) {
  return {.xyz_mm = pose.position_mm, .rpy_deg = degrees * roll_pitch_yaw(pose.rotation)};
}

// The frame in whose plane z = 0 the points lie best, their centroid at its origin.
Pose plane_through(const Eigen::MatrixXd& points) {
  const Eigen::RowVector3d centroid = points.colwise().mean();
  const Eigen::MatrixXd from_centroid = points.rowwise() - centroid;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(from_centroid, Eigen::ComputeThinV);
  const Eigen::Vector3d normal = svd.matrixV().col(2);
  Pose frame;
  frame.rotation = Eigen::Quaterniond::FromTwoVectors(normal, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  frame.position_mm = -frame.rotation * centroid.transpose();
  return frame;
}

}  // namespace

Robot with_closed_form_base(Robot robot, const Measurements& measurements) {
  robot.chain.base = Frame{};
  robot.chain.base = frame_of(kabsch(positions(robot, measurements.poses), measurements.positions_mm));
  return robot;
}

Robot with_base_on_plane(Robot robot, const Measurements& measurements) {
  robot.chain.base = Frame{};
  robot.chain.base = frame_of(plane_through(positions(robot, measurements.poses)));
  return robot;
}

Robot with_closed_form_tool(Robot robot, const Measurements& measurements) {
  Robot at_flange = robot;
  at_flange.chain.tool = Frame{};
  const std::vector<Pose> flanges = tool_poses(at_flange, measurements.poses);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < flanges.size(); ++i) {
    const Eigen::Vector3d point = measurements.positions_mm.row(static_cast<Eigen::Index>(i)).transpose();
    sum += flanges[i].rotation.transpose() * (point - flanges[i].position_mm);
  }
  robot.chain.tool.xyz_mm = sum / static_cast<double>(flanges.size());
  return robot;
}

Robot with_closed_form_orientation(Robot robot, const Measurements& measurements) {
  Robot at_flange = robot;
  at_flange.chain.tool = Frame{};
  const std::vector<Pose> flanges = tool_poses(at_flange, measurements.poses);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < flanges.size(); ++i) {
    sum += flanges[i].rotation.transpose() * measurements.poses.observations[i].reference;
  }
  robot.chain.tool.rpy_deg = degrees * roll_pitch_yaw(rotation_of_greatest_trace(sum.transpose()));
  return robot;
}

Robot with_base_by_distances(Robot robot, const Measurements& measurements) {
  Robot at_origin = robot;
  at_origin.chain.base.xyz_mm.setZero();
  const std::vector<Pose> tools = tool_poses(at_origin, measurements.poses);
  Eigen::MatrixX4d equations(measurements.count(), 4);
  Eigen::VectorXd right(measurements.count());
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    const Eigen::Vector3d& p = tools[i].position_mm;
    equations.row(i) << 2.0 * p.transpose(), 1.0;
    right(i) = std::pow(measurements.positions_mm(i, 0), 2) - p.squaredNorm();
  }
  const Eigen::Vector4d solution = equations.colPivHouseholderQr().solve(right);
  robot.chain.base.xyz_mm = solution.head<3>();
  return robot;
}

}  // namespace llmt::robotics
