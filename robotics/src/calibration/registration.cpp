#include "calibration/registration.hpp"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

#include "kinematics/rotations.hpp"
#include "kinematics/units.hpp"

namespace llmt::robotics {

Eigen::Vector3d roll_pitch_yaw_deg(const Eigen::Matrix3d& rotation) {
  const double cosine_of_pitch = std::hypot(rotation(0, 0), rotation(1, 0));
  const double pitch = std::atan2(-rotation(2, 0), cosine_of_pitch);
  // At pitch +-90 deg only roll -+ yaw is defined: yaw is taken as zero.
  const bool degenerate = cosine_of_pitch < 1e-12;
  const double roll =
      degenerate ? std::atan2(-rotation(1, 2), rotation(1, 1)) : std::atan2(rotation(2, 1), rotation(2, 2));
  const double yaw = degenerate ? 0.0 : std::atan2(rotation(1, 0), rotation(0, 0));
  return Eigen::Vector3d(roll, pitch, yaw) * degrees;
}

namespace {

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
  const Eigen::MatrixXd points = positions(robot, measurements.poses);
  const std::vector<Observation>& observations = measurements.poses.observations;
  const bool on_plane = !observations.empty() && is_plane(observations.front().base);
  const Pose base = on_plane ? plane_through(points) : kabsch(points, measurements.positions_mm);
  robot.chain.base = {.xyz_mm = base.position_mm, .rpy_deg = roll_pitch_yaw_deg(base.rotation)};
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
  robot.chain.tool.rpy_deg = roll_pitch_yaw_deg(rotation_of_greatest_trace(sum.transpose()));
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
