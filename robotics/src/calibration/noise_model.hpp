// Standard deviations of readings: what a file states, and what the residuals add to it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/robotics/calibration_options.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// Standard deviations of what the model does not explain, of positions (or distances) and of orientations. Those of
/// single readings that a file states come on top: sigma^2 = common^2 + stated^2.
struct CommonNoise {
  double position_mm = 0.0;
  double orientation_mm = 0.0;  ///< times the lever of the readings
};

class NoiseModel {
 public:
  NoiseModel(const Measurements& measurements, const CalibrationOptions& options);

  /// From residuals of the measured coordinates, after a fit of `rank` parameters: the common noise at which the sum of
  /// squares of every kind, divided by sigma^2, is its number of degrees of freedom. Stated noise stays.
  CommonNoise estimate(const Eigen::VectorXd& residuals, Eigen::Index rank) const;

  /// Smallest sigma / sigma of each measured coordinate, with the common noise that the residuals say; empty if nothing
  /// is stated.
  Eigen::VectorXd relative_weights(const Eigen::VectorXd& residuals) const;

  /// 1 / sigma of each measured coordinate.
  Eigen::VectorXd weights(const CommonNoise& noise) const;

 private:
  std::vector<bool> turns_;  // the coordinate belongs to an orientation
  Eigen::VectorXd stated_mm_;
  CommonNoise fixed_;

  double estimate_kind(const Eigen::VectorXd& residuals, Eigen::Index rank, bool turns) const;
};

}  // namespace llmt::robotics
