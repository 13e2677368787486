// Checks of a robot that its reader shares.
#pragma once

#include <cstddef>

#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

/// Checks one effect of a robot. Throws std::invalid_argument as effect_index(), and if a number is not finite.
void validate(const Chain& chain, const Effect& effect);

}  // namespace llmt::robotics
