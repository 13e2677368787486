#include "calibration/machine_size.hpp"

#include <cmath>

#include "llmt/robotics/calibration_report.hpp"

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

double size_of(const Chain& chain, const Measurements& measurements) {
  const double size = reach_of(chain) - chain.tool.xyz_mm.norm() + travel_of(chain, measurements.poses);
  if (size > 0.0 || measurements.count() == 0) return size;
  const Eigen::MatrixXd& points = measurements.positions_mm;
  return std::sqrt((points.rowwise() - points.colwise().mean()).squaredNorm() / static_cast<double>(points.rows()));
}

}  // namespace llmt::robotics
