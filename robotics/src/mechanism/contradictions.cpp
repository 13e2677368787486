// Poses whose readings contradict those of the others, by robust scales of the errors.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "llmt/robotics/mechanism/mechanism_calibration.hpp"

namespace llmt::robotics {
namespace {

// One in 500 million normal errors lies beyond, and hardly any error of a wrong description.
constexpr double most_scales = 6.0;
// Rounding, in mm, degrees and multiples of sigma: readings without noise contradict each other by as much.
constexpr double least_scale = 1e-6;

std::vector<Eigen::Index> far_off(const MechanismErrors& errors) {
  std::vector<bool> is_far(errors.values.rows(), false);
  for (const auto column : errors.values.colwise()) {
    std::vector<double> sizes;
    for (const double error : column) {
      if (std::isfinite(error)) sizes.push_back(std::abs(error));
    }
    if (sizes.empty()) continue;
    constexpr double normal_median = 0.6745;  // of the magnitudes of normal errors, in standard deviations
    const auto middle = sizes.begin() + std::ssize(sizes) / 2;
    std::ranges::nth_element(sizes, middle);
    const double scale = std::max(*middle / normal_median, least_scale);
    for (Eigen::Index row = 0; row < column.size(); ++row) {
      if (std::abs(column(row)) > most_scales * scale) is_far[row] = true;  // not NaN
    }
  }
  std::vector<Eigen::Index> far;
  for (std::size_t row = 0; row < is_far.size(); ++row) {
    if (is_far[row]) far.push_back(static_cast<Eigen::Index>(row));
  }
  return far;
}

}  // namespace

std::vector<Eigen::Index> contradicting_poses(const Mechanism& mechanism, const Eigen::MatrixXd& measured) {
  constexpr int most_passes = 10;
  std::vector<Eigen::Index> far = far_off(errors_of(mechanism, measured));
  for (int pass = 0; pass < most_passes; ++pass) {
    std::vector<Eigen::Index> kept;
    for (Eigen::Index row = 0; row < measured.rows(); ++row) {
      if (!std::ranges::binary_search(far, row)) kept.push_back(row);
    }
    try {
      const MechanismCalibration calibration = calibrate(mechanism, measured(kept, Eigen::all));
      if (calibration.result.dof <= 0) return far;
      std::vector<Eigen::Index> next = far_off(errors_of(calibration.mechanism, measured));
      if (next == far) return far;
      far = std::move(next);
    } catch (const std::invalid_argument&) {
      return far;  // what is left does not tell the parameters
    }
  }
  return far;
}

}  // namespace llmt::robotics
