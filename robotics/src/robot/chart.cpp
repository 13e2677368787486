#include "robot/chart.hpp"

#include <cmath>

#include "kinematics/rotations.hpp"

namespace llmt::robotics {
namespace {

// d log(exp(w) R) / dw at w = 0, the inverse of the left Jacobian of SO(3) at r = log(R):
// I - [r]/2 + (1 - (t/2) cot(t/2)) / t^2 [r]^2, t = |r| (e.g. Sola et al. 2018, eq. 146).
Eigen::Matrix3d log_derivative(const Eigen::Vector3d& r) {
  const double t = r.norm();
  constexpr double small = 1e-4;
  const double factor = t < small ? 1.0 / 12.0 : (1.0 - 0.5 * t / std::tan(0.5 * t)) / (t * t);
  const Eigen::Matrix3d cross = cross_matrix(r);
  return Eigen::Matrix3d::Identity() - 0.5 * cross + factor * cross * cross;
}

}  // namespace

Eigen::Vector3d reading_of(const Pose& tool, const Observation* observation) {
  if (observation == nullptr || observation->reading == Reading::position) return tool.position_mm;
  if (observation->reading == Reading::distance) return {tool.position_mm.norm(), 0.0, 0.0};
  return observation->lever_mm * rotation_vector(tool.rotation * observation->reference.transpose());
}

Eigen::Matrix3d reading_derivative(const Pose& tool, const Observation& observation) {
  if (observation.reading == Reading::position) return Eigen::Matrix3d::Identity();
  if (observation.reading == Reading::orientation) {
    return observation.lever_mm * log_derivative(rotation_vector(tool.rotation * observation.reference.transpose()));
  }
  Eigen::Matrix3d derivative = Eigen::Matrix3d::Zero();
  const double distance = tool.position_mm.norm();
  if (distance > 0.0) derivative.row(0) = tool.position_mm.transpose() / distance;
  return derivative;
}

}  // namespace llmt::robotics
