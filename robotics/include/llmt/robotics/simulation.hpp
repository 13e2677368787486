/// \file
/// Measurements of robots that are not there.
#pragma once

#include <cstdint>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

struct SimulationOptions {
  Eigen::Index poses = 200;
  double noise_um = 0.0;  ///< standard deviation of each measured coordinate, normal
  std::uint64_t seed = 1;
};

/// Poses uniform within the joint limits (revolute joints without limits: +-180 deg), and where the robot, its effects
/// included, puts its tool. The same options give the same numbers on every platform, up to the last bits of sine and
/// cosine. Throws std::invalid_argument: see validate(Robot); fewer than one pose, negative noise, a prismatic joint
/// without limits, an effect that needs a column.
Measurements simulate(const Robot& robot, const SimulationOptions& options = {});

/// All combinations of joint values from the lower limit in equal steps, the last joint fastest: the paper's grids.
/// Throws std::invalid_argument if step_rad is not positive, a joint has no limits or is prismatic, or there would be
/// more than 10 million.
Poses grid(const Chain& chain, double step_rad);

}  // namespace llmt::robotics
