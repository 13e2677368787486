#include "calibration/still_joints.hpp"

#include "calibration/joint_ranges.hpp"
#include "llmt/robotics/kinematics.hpp"

namespace llmt::robotics {
namespace {

bool is_still(const Joint& joint, const std::array<double, 2>& range) {
  return range[1] - range[0] < still_range(joint);
}

}  // namespace

std::vector<StillJoint> still_joints(const Chain& chain, const Poses& poses) {
  std::vector<StillJoint> still;
  const std::vector<std::array<double, 2>> ranges = joint_ranges_of(chain, poses);
  for (std::size_t j = 0; j < ranges.size(); ++j) {
    const Joint& joint = chain.joints[j];
    if (is_still(joint, ranges[j])) still.push_back({joint.name, limit_unit(joint), ranges[j][1] - ranges[j][0]});
  }
  return still;
}

Poses with_still_joints_held(const Chain& chain, Poses poses) {
  const std::vector<std::array<double, 2>> ranges = joint_ranges_of(chain, poses);
  for (std::size_t j = 0; j < ranges.size(); ++j) {
    auto values = poses.joints.col(static_cast<Eigen::Index>(j));
    if (is_still(chain.joints[j], ranges[j])) values.setConstant(0.5 * (values.minCoeff() + values.maxCoeff()));
  }
  return poses;
}

}  // namespace llmt::robotics
