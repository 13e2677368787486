/// \file
/// Mechanisms of any kind, loops included, given by their constraint equations f(d, s, w) = 0 (eq. 3 of Benes et al.
/// 2022): d are parameters, s coordinates of joints, w outputs such as the position of a platform.
///
///     Mechanism crank{.name = "crank"};
///     crank.parameters = {{.name = "r", .unit = "mm", .value = 50.0}};
///     crank.coordinates = {{.name = "q", .unit = "deg"}, {.name = "x", .unit = "mm", .output = true}};
///     crank.equations = {"r*cos(q) = x"};
///     const Assembly assembly = assemble(crank, Eigen::RowVector2d(60.0, NAN));  // x = 25 mm
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "llmt/abi.hpp"
#include "llmt/robotics/mechanism/mechanism_types.hpp"

namespace llmt::robotics {

/// Throws std::invalid_argument for names that are no identifiers, are repeated or are functions of the language,
/// unknown units, numbers that are not finite, sigmas or priors out of range, limits that are no interval, expressions
/// that cannot be read or use unknown names, parameters and coordinates that occur in no equation, and a mechanism
/// without coordinates or equations.
void validate(const Mechanism& mechanism);

/// The standard deviation of every coordinate's readings, in its unit; 0: exact. Without any sigma among the measured
/// coordinates, readings of the outputs have all the same, 1, and those of joints are exact, as in the paper; where no
/// output is measured, readings of all joints have the same, 1. Where some have a sigma, the others are exact.
///
/// `known`: poses x coordinates, NaN where not measured. Throws std::invalid_argument if coordinates of different units
/// would share one sigma.
Eigen::VectorXd noise_of(const Mechanism& mechanism, const Eigen::MatrixXd& known);

/// Completes poses: solves the equations for the coordinates that are not known. Where there are more equations than
/// unknown coordinates, the known ones that are not exact are corrected: the sum of (correction / sigma)^2 is the
/// smallest that meets all equations.
///
/// A loop has several configurations. The branch is that of the start values: every pose is reached from a solved one
/// (the first from the start) along the straight line between what is known, in steps small enough that the rest
/// follows its tangent. Angles whose whole turns change no equation go the short way round, and the long way where the
/// short one is blocked. A pose behind a singular configuration fails. Where readings check each other, the branch that
/// contradicts them least is taken, also among those of poses nearby.
///
/// `known`: poses x coordinates, NaN where unknown. Throws std::invalid_argument for a wrong shape, infinite values, as
/// validate(), and if the start values are near no configuration.
Assembly assemble(const Mechanism& mechanism, const Eigen::MatrixXd& known);

/// Random poses: coordinates with limits are uniform within them, the others are solved for; draws that cannot be
/// assembled are drawn again. `count` x coordinates, exact. Throws std::invalid_argument as assemble() and if no
/// coordinate has limits, std::runtime_error if fewer than one draw in twenty can be assembled.
Eigen::MatrixXd random_poses(const Mechanism& mechanism, Eigen::Index count, std::uint64_t seed);

}  // namespace llmt::robotics
