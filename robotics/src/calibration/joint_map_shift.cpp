#include "calibration/joint_map_shift.hpp"

#include <algorithm>

namespace llmt::robotics {

std::pair<Eigen::Index, double> EvenKnots::place(double q) const {
  const double u = std::clamp((q - first) / step, 0.0, static_cast<double>(count - 1));
  const auto below = std::min(static_cast<Eigen::Index>(u), std::max<Eigen::Index>(0, count - 2));
  return {below, u - static_cast<double>(below)};
}

Unmapped unmapped(const Robot& robot, const Measurements& measurements) {
  Unmapped plain{robot, measurements, {}};
  std::erase_if(plain.robot.effects, [&](const Effect& effect) {
    if (effect.type != "joint_map") return false;
    plain.maps.push_back(effect);
    return true;
  });
  for (const Effect& map : plain.maps) {
    const Eigen::Index joint = joint_index(robot.chain, map.at);
    if (joint >= plain.measurements.poses.joints.cols()) continue;  // for validate() to refuse
    const EvenKnots knots{map.constants[0], map.constants[1], std::ssize(map.values)};
    for (Eigen::Index i = 0; i < measurements.count(); ++i) {
      const auto [below, above] = knots.place(measurements.poses.joints(i, joint));
      double& q = plain.measurements.poses.joints(i, joint);
      // A map may have one knot.
      q += above > 0.0 ? (1.0 - above) * map.values[below] + above * map.values[below + 1] : map.values[below];
    }
  }
  return plain;
}

}  // namespace llmt::robotics
