#include "calibration/joint_ranges.hpp"

namespace llmt::robotics {

std::vector<std::array<double, 2>> joint_ranges_of(const Chain& chain, const Poses& poses) {
  std::vector<std::array<double, 2>> ranges;
  for (Eigen::Index j = 0; j < poses.joints.cols(); ++j) {
    const Eigen::VectorXd values = poses.joints.col(j) * to_limit_unit(chain.joints[j]);
    ranges.push_back({values.minCoeff(), values.maxCoeff()});
  }
  return ranges;
}

double still_range(const Joint& joint) {
  constexpr double still_deg = 0.1;
  constexpr double still_mm = 1.0;
  return joint.type == JointType::revolute ? still_deg : still_mm;
}

}  // namespace llmt::robotics
