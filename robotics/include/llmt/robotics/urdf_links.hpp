/// \file
/// The two links of a URDF file between which the arm lies.
#pragma once

#include <string>

namespace llmt::robotics {

/// The names of the links that are base and tip of the arm.
struct UrdfLinks {
  std::string base;  ///< empty: the root of the file
  std::string tip;   ///< empty: the only end of a chain with joints that move
};

}  // namespace llmt::robotics
