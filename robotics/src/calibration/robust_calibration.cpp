#include <algorithm>
#include <cmath>
#include <set>

#include "llmt/robotics/calibration.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

// The longest residual of normal noise among thousands is three times the median.
constexpr double far_off = 4.0;

// Lengths of the residuals; where standard deviations are stated, counted in them.
Eigen::VectorXd lengths_of(const Calibration& calibration, const Measurements& measurements) {
  Eigen::VectorXd errors = distances(positions(calibration.robot, measurements.poses), measurements);
  const Eigen::VectorXd stated = stated_sigma_mm(measurements).rowwise().maxCoeff();
  if ((stated.array() == 0.0).all()) return errors;
  constexpr double smallest_mm = 1e-9;
  for (const Eigen::Index i : position_rows(measurements.poses)) {
    errors(i) /= std::max(smallest_mm, std::hypot(calibration.noise_mm, stated(i)));
  }
  return errors;
}

// Each kind of reading is compared with its own median.
std::vector<std::size_t> far_samples(const Calibration& calibration, const Measurements& measurements) {
  const Eigen::VectorXd errors = lengths_of(calibration, measurements);
  std::vector<std::size_t> far;
  for (const auto& rows : {position_rows(measurements.poses), orientation_rows(measurements.poses)}) {
    if (rows.empty()) continue;
    const double limit = far_off * median(errors(rows));
    for (const Eigen::Index i : rows) {
      if (errors(i) > limit) far.push_back(static_cast<std::size_t>(i));
    }
  }
  std::ranges::sort(far);
  return far;
}

}  // namespace

RobustCalibration calibrate_robustly(const Robot& robot, const Measurements& measurements,
                                     const CalibrationOptions& options) {
  RobustCalibration start{calibrate(robot, measurements, options), {}};
  // With fewer than three fifths of the rows the parameters would fit anything.
  const Eigen::Index least = measurements.count() * 3 / 5;
  std::set<std::vector<std::size_t>> seen = {{}};
  constexpr int passes = 20;
  for (int pass = 0; pass < passes; ++pass) {
    std::vector<std::size_t> far = far_samples(start.calibration, measurements);
    if (measurements.count() - std::ssize(far) < least || !seen.insert(far).second) break;
    start.calibration = calibrate(robot, without_rows(measurements, far), options);
    start.left_out = std::move(far);
  }
  return start;
}

}  // namespace llmt::robotics
