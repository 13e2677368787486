/// \file
/// Order statistics of residuals that are shifted and scaled, from which intervals are made.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace llmt {

/// The values offset + factor r over residuals r, which ascend; factor >= 0.
struct ScaledResiduals {
  std::span<const double> residuals;
  double offset = 0.0;
  double factor = 1.0;

  double value(std::size_t index) const { return offset + factor * residuals[index]; }
};

/// The rank-th largest of all values, rank from 1 to their number: by bisection, in a time that grows with the
/// logarithm of the number of residuals.
double largest_value(std::span<const ScaledResiduals> parts, Eigen::Index rank);

/// By how much intervals are wider in a Gap: the 99th percentile of residuals over their 90th; 1 if that is 0.
double factor_in_gaps(std::span<const ScaledResiduals> parts);

/// Number of values that lie outside an interval at either end: floor(a (n + 1)) with a = 1 - level.
Eigen::Index values_outside(double level, Eigen::Index rows);

/// Throws std::invalid_argument, beginning with `what`, if the level is not between 0 and 1 or `rows` held-out rows are
/// too few for it.
void check_level(const char* what, double level, Eigen::Index rows);

}  // namespace llmt
