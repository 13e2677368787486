#include "hypotheses/scene.hpp"

#include "llmt/statistics.hpp"

namespace llmt::robotics {

Scene make_scene(const Robot& robot, const Poses& poses, const Eigen::VectorXd& residuals,
                 const std::array<bool, 3>& measured) {
  Scene scene{robot, poses, residuals, measured, {}, gravity_loads(robot, poses), residuals};
  const Eigen::MatrixXd motions = joint_motions(robot, poses);
  scene.lever.assign(robot.chain.joints.size(), Eigen::MatrixXd::Zero(3 * poses.count(), 1));
  Eigen::VectorXd size(poses.count());
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    for (std::size_t j = 0; j < scene.lever.size(); ++j) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        if (measured[axis]) scene.lever[j](3 * i + axis, 0) = motions(3 * i + axis, j);
      }
    }
    size(i) = residuals.segment(3 * i, 3).norm();
  }
  // A lost beam would dominate every scan, so it is shortened. Whether it is an outlier is decided by the search.
  constexpr double far_beyond = 6.0;
  const double limit = far_beyond * median(size);
  for (Eigen::Index i = 0; i < size.size(); ++i) {
    if (size(i) > limit) scene.clipped.segment(3 * i, 3) *= limit / size(i);
  }
  return scene;
}

JointSignal joint_signal(const Scene& scene, std::size_t joint) {
  JointSignal signal;
  const Eigen::Index n = scene.poses.count();
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto lever = scene.lever[joint].col(0).segment(3 * i, 3);
    signal.rows.push_back(i);
    signal.along.push_back(lever.dot(scene.clipped.segment(3 * i, 3)));
    signal.weight.push_back(lever.squaredNorm());
    signal.angle.push_back(scene.poses.joints(i, joint));
  }
  if (!signal.angle.empty()) {
    const auto [low, high] = std::ranges::minmax(signal.angle);
    signal.low = low;
    signal.high = high;
  }
  return signal;
}

}  // namespace llmt::robotics
