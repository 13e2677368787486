#include "calibration/input_mistakes.hpp"

#include <Eigen/Geometry>
#include <stdexcept>
#include <vector>

#include "calibration/registration.hpp"
#include "kinematics/rotations.hpp"
#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {

std::string orientation_mistake(const Robot& robot, const Measurements& measurements) {
  constexpr double plausible_rad = 0.05;
  const std::vector<Eigen::Index> turned = orientation_rows(measurements.poses);
  Robot placed = robot;
  try {
    register_frames(placed, select(measurements, position_rows(measurements.poses)));
  } catch (const std::exception&) {
    return {};
  }
  const std::vector<Pose> tools = tool_poses(placed, select(measurements.poses, turned));
  const auto mean_angle = [&](const auto& meant) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    std::vector<Eigen::Matrix3d> between;
    for (std::size_t k = 0; k < turned.size(); ++k) {
      between.push_back(tools[k].rotation.transpose() * meant(measurements.poses.observations[turned[k]].reference));
      sum += between.back();
    }
    const Eigen::Matrix3d common = rotation_of_greatest_trace(sum.transpose());
    double angles = 0.0;
    for (const Eigen::Matrix3d& one : between) angles += Eigen::AngleAxisd(common.transpose() * one).angle();
    return angles / static_cast<double>(between.size());
  };
  const auto inverse = [](const Eigen::Matrix3d& read) -> Eigen::Matrix3d { return read.transpose(); };
  if (mean_angle(inverse) < plausible_rad) return "the file has the rotation of the world as seen from the tool";
  // The numbers that were read as w, x, y, z are x, y, z, w.
  const auto reordered = [](const Eigen::Matrix3d& read) -> Eigen::Matrix3d {
    const Eigen::Quaterniond q(read);
    return Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
  };
  if (measurements.orientation.kind == Orientation::Kind::quaternion && mean_angle(reordered) < plausible_rad) {
    return "the columns qw, qx, qy, qz hold x, y, z, w";
  }
  return {};
}

}  // namespace llmt::robotics
