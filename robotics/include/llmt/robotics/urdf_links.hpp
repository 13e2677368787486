/// \file
/// The ends of an arm in a URDF file.
#pragma once

#include <string>

namespace llmt::robotics {

/// Which links of a URDF are base and tip of the arm.
struct UrdfLinks {
  std::string base;  ///< empty: the root
  std::string tip;   ///< empty: the only end of a chain with joints that move
};

}  // namespace llmt::robotics
