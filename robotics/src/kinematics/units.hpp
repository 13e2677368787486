/// \file
/// Units of angles.
#pragma once

#include <numbers>

namespace llmt::robotics {

inline constexpr double radians = std::numbers::pi / 180.0;  ///< in one degree
inline constexpr double degrees = 180.0 / std::numbers::pi;  ///< in one radian

}  // namespace llmt::robotics
