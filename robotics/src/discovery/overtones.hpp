// Whether an angle error that was named as a wave is no sine.
#pragma once

#include "discovery/investigation.hpp"
#include "llmt/robotics/discovery_result.hpp"

namespace llmt::robotics {

/// A wave of a gear is a sine with perhaps one overtone of twice its order. A saw tooth, a step in every turn of a
/// shaft and the like have overtones of 3, 4 and 5 times the order as well. Where those, fitted to what is left, are
/// beyond chance and hold a material share of the wave's own energy, the wave is a piece of an unknown effect: its name
/// is no longer confirmed, and the shape is added to what is unknown.
void doubt_waves(const Investigation& investigation, Discovery& result);

}  // namespace llmt::robotics
