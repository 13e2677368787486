// The start of the search for bases and tools.
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/least_squares.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// Least squares over the parameters without a reason to be fixed; the robot gets the result.
discovery::SolverResult solve_for(Robot& robot, discovery::LeastSquaresProblem problem,
                                  const std::vector<std::string>& reasons, const discovery::SolverOptions& solver);

/// Derivatives of calibration_problem() by the parameters without a reason to be fixed; the other columns, which nobody
/// reads, are zero. `of_rigid_arm`: as if the robot had no effects; then none of their values may be free. Robot and
/// poses are copied into it.
discovery::Jacobian free_derivatives(const Robot& robot, const Measurements& measurements,
                                     const std::vector<std::string>& reasons, bool of_rigid_arm);

/// The same as solve_for() over bases and tools alone, by derivatives of the rigid arm. Those of an arm that bends tell
/// a turn of the tool from the place of the payload, by a thousandth of what the effects do: a fit would turn it at
/// will.
discovery::SolverResult fit_frames(Robot& robot, const Measurements& measurements,
                                   const std::vector<std::string>& reasons, const discovery::SolverOptions& solver);

/// The robot with its bases and tools near those of the measurements, setting after setting: a base that is free in
/// closed form for several guesses of the tool, then a small fit; tools on a base that is known in closed form. Frames
/// with a reason to be fixed, and those that the measured coordinates do not suffice for, stay as they are.
Robot with_started_frames(Robot robot, const Measurements& measurements, const std::vector<std::string>& reasons,
                          const discovery::SolverOptions& solver);

}  // namespace llmt::robotics
