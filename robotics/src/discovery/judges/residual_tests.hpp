// Tests of residuals against the scatter of an instrument.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {

/// A pattern in residuals that an instrument's noise has not.
struct ResidualStructure {
  std::string where;   ///< "joint2", "instrument", "session"
  std::string reason;  ///< a sentence
};

/// Tests the residuals of a fit, without the poses that were skipped (ascending) and with repeats of a pose averaged:
///
/// - their share along the motion by each joint, against that of vectors of the same lengths and random directions,
///   which may be distributed differently along the world's axes or along those of an instrument at the origin;
/// - the likeness of neighbours, against random orders: neighbours in the order of measuring, in azimuth, elevation and
///   distance from the origin, and, along the motion by each joint, in the angle of each joint.
///
/// Random residuals are projected through the same fit. A test rejects when its statistic is more than 4.5 standard
/// deviations above their mean. Returns the first pattern found.
std::optional<ResidualStructure> find_structure(const Calibration& fitted, const Measurements& measurements,
                                                const std::vector<std::size_t>& skipped, std::uint64_t seed);

/// The weight of the tail of n lengths: root mean square over median, in units of that ratio for normal vectors of d
/// components. A few long ones that make up most of the sum of squares give a large weight.
double tail_weight(const Eigen::VectorXd& lengths, Eigen::Index components);

}  // namespace llmt::robotics
