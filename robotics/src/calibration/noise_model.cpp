#include "calibration/noise_model.hpp"

#include <algorithm>
#include <cmath>

namespace llmt::robotics {

NoiseModel::NoiseModel(const Measurements& measurements, const CalibrationOptions& options) {
  const std::vector<Eigen::Index> coordinates = measured_rows(measurements);
  const std::vector<Observation>& observations = measurements.poses.observations;
  const Eigen::MatrixXd stated = stated_sigma_mm(measurements);
  stated_mm_.resize(std::ssize(coordinates));
  for (Eigen::Index k = 0; k < stated_mm_.size(); ++k) {
    const Eigen::Index row = coordinates[k] / 3;
    stated_mm_(k) = stated(row, coordinates[k] % 3);
    turns_.push_back(!observations.empty() && observations[row].reading == Reading::orientation);
    if (turns_.back()) fixed_.orientation_mm = 1e-3 * options.orientation_noise_mrad * observations[row].lever_mm;
  }
  fixed_.position_mm = options.position_noise_mm;
}

double NoiseModel::estimate_kind(const Eigen::VectorXd& residuals, Eigen::Index rank, bool turns) const {
  std::vector<Eigen::Index> own;
  for (Eigen::Index k = 0; k < residuals.size(); ++k) {
    if (turns_[k] == turns) own.push_back(k);
  }
  if (own.empty()) return 0.0;
  const Eigen::VectorXd errors = residuals(own);
  const Eigen::ArrayXd stated = stated_mm_(own);
  // Parameters take their share of the degrees of freedom from every kind.
  const auto all = static_cast<double>(residuals.size());
  const double left = all - static_cast<double>(rank);
  const double freedom = std::max(1.0, static_cast<double>(own.size()) * left / all);
  double high = errors.norm() / std::sqrt(freedom);
  if ((stated == 0.0).all()) return high;
  double low = 0.0;
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (low + high);
    const double sum = (errors.array().square() / (middle * middle + stated.square())).sum();
    (sum > freedom ? low : high) = middle;
  }
  return high;
}

CommonNoise NoiseModel::estimate(const Eigen::VectorXd& residuals, Eigen::Index rank) const {
  CommonNoise noise = fixed_;
  if (!(noise.position_mm > 0.0)) noise.position_mm = estimate_kind(residuals, rank, false);
  if (!(noise.orientation_mm > 0.0)) noise.orientation_mm = estimate_kind(residuals, rank, true);
  return noise;
}

Eigen::VectorXd NoiseModel::relative_weights(const Eigen::VectorXd& residuals) const {
  if ((stated_mm_.array() == 0.0).all()) return {};
  Eigen::VectorXd relative = weights(estimate(residuals, 0));
  relative /= relative.maxCoeff();
  return relative;
}

Eigen::VectorXd NoiseModel::weights(const CommonNoise& noise) const {
  constexpr double smallest_mm = 1e-9;
  Eigen::VectorXd weights(stated_mm_.size());
  for (Eigen::Index k = 0; k < weights.size(); ++k) {
    const double common = turns_[k] ? noise.orientation_mm : noise.position_mm;
    const double sigma = stated_mm_(k) > 0.0 ? std::hypot(common, stated_mm_(k)) : common;
    weights(k) = 1.0 / std::max(smallest_mm, sigma);
  }
  return weights;
}

}  // namespace llmt::robotics
