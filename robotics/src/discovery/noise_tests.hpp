// Whether residuals look like what an instrument scatters.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {

/// What in the residuals is no instrument's noise.
struct NoNoise {
  std::string where;   ///< "joint2", "instrument", "session"
  std::string reason;  ///< a sentence
};

/// Tests the residuals of a fit, without the poses that were skipped (ascending) and with repeats of a pose averaged:
///
/// - their share along the motion by each joint, against that of vectors of the same lengths and random directions,
///   which may be distributed differently along the world's axes or along those of an instrument at the origin;
/// - whether neighbours are alike: in the order of measuring, in azimuth, elevation and distance from the origin, and,
///   along the motion by each joint, in the angle of each joint. Against random orders.
///
/// Random draws take the same way through the fit as the residuals. A test speaks where the residuals are further from
/// the mean of the draws than 4.5 of their standard deviations.
std::optional<NoNoise> no_noise(const Calibration& fitted, const Measurements& measurements,
                                const std::vector<std::size_t>& skipped, std::uint64_t seed);

/// Whether a few of the lengths make up most of the sum of squares: root mean square over median, in units of that
/// ratio for normal vectors of d components.
double tail_of(const Eigen::VectorXd& lengths, Eigen::Index components);

}  // namespace llmt::robotics
