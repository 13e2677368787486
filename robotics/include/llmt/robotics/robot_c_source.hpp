/// \file
/// A corrected robot as C source, for its controller.
#pragma once

#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/c_source.hpp"
#include "llmt/robotics/correction.hpp"

namespace llmt::robotics {

/// The columns of conditions that the exported functions take, in their order: payload_kg, then those that the effects
/// need.
std::vector<std::string> c_conditions(const Robot& robot);

/// The forward model with its effects and correction, and one step of compensate(), as C99 without dependencies but
/// <math.h>:
///
///     void   NAME_forward(const double *conditions, const double *q, double *position, double *rotation);
///     double NAME_step(const double *conditions, const double *position, const double *rotation, double *q);
///
/// Joint values q in rad (mm): those of the joints with a drive, in their order; joints that mimic others follow.
/// Positions in mm in the world frame, rotations as nine numbers, row by row. NAME_step() changes q towards the
/// asked-for pose (rotation 0, or fewer than six drives: position alone), within the joints' limits, and returns how
/// far the pose was from it before, in mm, angles times the arm's reach: call it until that is small, at most some ten
/// times. It is the step of compensate() without damping; joints that a target leaves free change as little as possible
/// in each step. No memory is allocated, and the time is bounded.
///
/// Effects that act on a joint's value are exported: gain, eccentricity, transmission error, joint maps, springs,
/// coupling, compliance under gravity, backlash, hysteresis. Throws std::invalid_argument naming the first effect that
/// is none of them, and if `name` is no identifier of C of at most 26 characters.
CSource to_c(const CorrectedRobot& robot, const std::string& name, const std::string& header_name);

}  // namespace llmt::robotics
