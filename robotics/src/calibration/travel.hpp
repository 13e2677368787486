// How far the slides of a machine go.
#pragma once

#include "llmt/robotics/chain.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// Sum of the ways of the slides in these poses, mm: largest less smallest value of each.
double travel_of(const Chain& chain, const Poses& poses);

}  // namespace llmt::robotics
