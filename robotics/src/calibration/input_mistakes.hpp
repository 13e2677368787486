// Likely mistakes in a table that cannot be meant as it stands.
#pragma once

#include <string>

#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// What goes wrong in measured orientations: quaternions written x, y, z, w, and rotations from the tool to the world.
/// Returns the change after which the described robot, placed by the positions, turns its tool as measured but for 50
/// mrad on average and a constant rotation; else nothing.
std::string orientation_mistake(const Robot& robot, const Measurements& measurements);

}  // namespace llmt::robotics
