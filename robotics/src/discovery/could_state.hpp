// What a user could state to know more.
#pragma once

#include <string>
#include <vector>

#include "discovery/verification.hpp"

namespace llmt::robotics {

/// A sentence each:
///
/// - the payload, where neither description nor poses state one, effects of weight were found, and a free payload
///   (mass and centre) beside them lowers the mean error on the poses set aside beyond chance, by a twentieth or more;
/// - the masses of the links, where compliances were found beside unknown ones.
std::vector<std::string> could_state(const Robots& robots, const PoseSplit& split, const Findings& found,
                                     const DiscoveryOptions& options);

}  // namespace llmt::robotics
