#include <algorithm>
#include <cmath>
#include <set>

#include "calibration/median.hpp"
#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {
namespace {

// The longest residual of normal noise among thousands is three times the median.
constexpr double far_off = 4.0;

std::vector<std::size_t> far_samples(const Robot& robot, const Measurements& measurements) {
  const Eigen::VectorXd errors = distances(positions(robot, measurements.poses), measurements);
  const double limit = far_off * median_of(errors);
  std::vector<std::size_t> far;
  for (Eigen::Index i = 0; i < errors.size(); ++i) {
    if (errors(i) > limit) far.push_back(static_cast<std::size_t>(i));
  }
  return far;
}

}  // namespace

double median_of(const Eigen::VectorXd& values) {
  std::vector<double> sorted(values.begin(), values.end());
  std::ranges::nth_element(sorted, sorted.begin() + std::ssize(sorted) / 2);
  return sorted[sorted.size() / 2];
}

RobustCalibration calibrate_robustly(const Robot& robot, const Measurements& measurements,
                                     const CalibrationOptions& options) {
  RobustCalibration start{calibrate(robot, measurements, options), {}};
  // More than that many parameters per coordinate, and calibration would explain anything.
  const Eigen::Index least = measurements.count() * 3 / 5;
  std::set<std::vector<std::size_t>> seen = {{}};
  constexpr int passes = 20;
  for (int pass = 0; pass < passes; ++pass) {
    std::vector<std::size_t> far = far_samples(start.calibration.robot, measurements);
    if (measurements.count() - std::ssize(far) < least || !seen.insert(far).second) break;
    start.calibration = calibrate(robot, without_rows(measurements, far), options);
    start.left_out = std::move(far);
  }
  return start;
}

}  // namespace llmt::robotics
