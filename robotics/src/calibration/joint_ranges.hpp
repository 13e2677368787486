// The joint values and conditions that a calibration saw.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

/// Smallest and largest value of each joint over the poses, deg or mm as limits are.
std::vector<std::array<double, 2>> joint_ranges_of(const Chain& chain, const Poses& poses);

/// Smallest and largest payload (of the chain, where the poses say nothing) and temperature.
std::map<std::string, std::array<double, 2>> condition_ranges_of(const Chain& chain, const Poses& poses);

/// A joint hardly moves if its values stay within this range: 0.1 deg, or 1 mm of a prismatic joint. An axis that is
/// one degree off then moves a tool at one metre by 0.03 mm, as little as the noise of an instrument: no fit should
/// rest on such a motion.
double still_range(const Joint& joint);

}  // namespace llmt::robotics
