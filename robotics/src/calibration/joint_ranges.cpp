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

std::map<std::string, std::array<double, 2>> condition_ranges_of(const Chain& chain, const Poses& poses) {
  std::map<std::string, std::array<double, 2>> ranges;
  if (poses.count() == 0) return ranges;
  ranges["payload_kg"] = {chain.payload.mass_kg, chain.payload.mass_kg};
  for (const char* name : {"payload_kg", "temp_C"}) {
    const auto column = poses.covariates.find(name);
    if (column != poses.covariates.end()) ranges[name] = {column->second.minCoeff(), column->second.maxCoeff()};
  }
  return ranges;
}

double still_range(const Joint& joint) {
  constexpr double still_deg = 0.1;
  constexpr double still_mm = 1.0;
  return joint.type == JointType::revolute ? still_deg : still_mm;
}

}  // namespace llmt::robotics
