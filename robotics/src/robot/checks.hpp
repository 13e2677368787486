// What the checks of a robot share with its reader.
#pragma once

#include <cstddef>

#include "llmt/robotics/robot_types.hpp"

namespace llmt::robotics {

inline constexpr std::size_t most_effects = 1000;
inline constexpr std::size_t most_effect_values = 10000;  // of all effects together

/// Checks one effect of a robot. Throws std::invalid_argument as effect_index(), and if a number is not finite.
void validate(const Chain& chain, const Effect& effect);

}  // namespace llmt::robotics
