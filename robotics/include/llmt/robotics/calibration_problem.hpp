/// \file
/// The least-squares problem behind a calibration.
///
///     const llmt::discovery::LeastSquaresProblem problem = calibration_problem(robot, measured);
///     const llmt::discovery::SolverResult result = llmt::discovery::solve(problem);
#pragma once

#include "llmt/discovery/least_squares.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

/// The problem of calibrate() before any parameter is fixed: residuals model - measured over the measured coordinates,
/// analytic Jacobian, every parameter of parameters(robot) marked free. Robot and measurements are copied into it.
discovery::LeastSquaresProblem calibration_problem(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
