// The changes that the joint maps of a robot make to its joint values.
#pragma once

#include <utility>
#include <vector>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// Equally spaced joint values between which a joint map is linear.
struct EvenKnots {
  double first = 0.0;
  double step = 1.0;
  Eigen::Index count = 0;

  /// Number of the knot below q and the weight of the one above; outside the knots those of the nearest end. A single
  /// knot has the weight 0 of one above.
  std::pair<Eigen::Index, double> place(double q) const;
};

/// A robot without its maps of joints, and measurements whose joint values the maps have moved: the same positions.
struct Unmapped {
  Robot robot;
  Measurements measurements;
  std::vector<Effect> maps;
};
Unmapped unmapped(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
