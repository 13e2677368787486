#include "calibration/travel.hpp"

namespace llmt::robotics {

double travel_of(const Chain& chain, const Poses& poses) {
  double travel = 0.0;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    if (chain.joints[j].type != JointType::prismatic || poses.joints.rows() == 0) continue;
    const auto values = poses.joints.col(static_cast<Eigen::Index>(j));
    travel += values.maxCoeff() - values.minCoeff();
  }
  return travel;
}

}  // namespace llmt::robotics
