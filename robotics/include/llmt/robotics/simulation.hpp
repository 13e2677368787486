/// \file
/// Simulated measurements.
///
///     const Measurements made = simulate(robot, {.poses = 200, .noise_um = 20.0});
#pragma once

#include <cstdint>

#include "llmt/progress.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

struct SimulationOptions {
  Eigen::Index poses = 200;  ///< 1 ... 1 000 000
  double noise_um = 0.0;     ///< standard deviation of each measured coordinate, normal; 0 ... 1e12
  std::uint64_t seed = 1;
  Progress progress = {};
};

/// Poses uniform within the joint limits (revolute joints without limits: +-180 deg), and where the robot, its effects
/// included, puts its tool. The same options give the same numbers on every platform, up to the last bits of sine and
/// cosine. Throws std::invalid_argument: see validate(Robot); a number of poses or a noise out of range, a prismatic
/// joint without limits. Throws std::runtime_error, see position_refusal(), if a position makes no sense. Columns that
/// effects need are filled in by with_needed_columns().
Measurements simulate(const Robot& robot, const SimulationOptions& options = {});

/// The same at given poses; `poses` of the options does not matter.
Measurements simulate(const Robot& robot, Poses poses, const SimulationOptions& options = {});

/// Adds the columns that the robot's effects need and the poses do not have, with neutral values where there are any:
///
///   order, time_s   number of the row
///   temp..._C       the reference temperature of the effect, or 20
///   dirN            -1 or +1, at random
///   moveN_...       from order, see add_moves()
///   tauN_Nm         the torque of gravity
///   qmeasN_...      the joint value
///   payload_kg      that of the description
///   others          0
Poses with_needed_columns(const Robot& robot, Poses poses, std::uint64_t seed);

/// All combinations of joint values from the lower limit in equal steps, the last joint fastest: the paper's grids.
/// Throws std::invalid_argument if step_rad is not positive, a joint has no limits or is prismatic, or there would be
/// more than 10 million.
Poses grid(const Chain& chain, double step_rad);

}  // namespace llmt::robotics
